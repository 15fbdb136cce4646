//! Renders a scene of the library from Rust: `cargo run --release --example render [SCENE
//! [INTEGRATOR [SPP]]]`.

use std::error::Error;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use pathspace::benches::output::{Metadata, Output, Picture, exposure};
use pathspace::benches::{Budget, expose};
use pathspace::core::Scene;
use pathspace::core::description::FilmDescription;
use pathspace::core::film::Layers;
use pathspace::integrators::{Defaults, Registry};
use pathspace::scenes::library;

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let name = args.next().unwrap_or("cornell-caustic".into());
    let spec = args.next().unwrap_or("bdpt:max_depth=8".into());
    let spp = args.next().map_or(Ok(16), |n| n.parse())?;

    // From a description, read or made by hand, to a scene that rays can be sent into.
    let loaded = library::find(&name).ok_or("no such scene")?.load(&[])?;
    let mut description = loaded.description;
    description.film = FilmDescription::new(128, 128);
    let scene = Arc::new(Scene::new(&description)?);

    // An integrator by its spec, as on the command line.
    let integrator = Registry::builtin().create(&spec.parse()?, &Defaults::default())?;
    let mut watch = |status: &pathspace::benches::Status| {
        eprint!("\r{} of {spp} samples per pixel", status.samples_per_pixel);
        ControlFlow::Continue(())
    };
    let budget = Budget::Samples(spp);
    let exposed = expose(&*integrator, &scene, Layers::NONE, 1, budget, &mut watch)?;

    // Linear radiance, rows from top to bottom.
    let pixels = exposed.film.image();
    let metadata = Metadata { scene: name, integrator: spec, ..Metadata::default() };
    let picture = Picture { film: description.film, pixels: &pixels, layers: &[], metadata };
    let output = Output::open(Path::new("render.exr"))?;
    output.write(&picture, exposure(&pixels))?;
    eprintln!(
        "\r{:.2} s, mean {:.4?}, in render.exr and render.png",
        exposed.spent.seconds,
        exposed.film.mean()
    );
    Ok(())
}
