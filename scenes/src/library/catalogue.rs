//! The list of scenes.

use super::{LibraryScene, MeshFile, models};

/// A scene whose XML is `scenes/library/NAME/scene.xml`.
macro_rules! scene {
    ($name:literal, $summary:literal $(, $path:literal => $generate:path)*) => {
        LibraryScene {
            name: $name,
            summary: $summary,
            xml: include_str!(concat!("../../library/", $name, "/scene.xml")),
            meshes: &[$(MeshFile { path: $path, generate: $generate }),*],
        }
    };
}

pub(super) const SCENES: &[LibraryScene] = &[
    scene!(
        "cornell-caustic",
        "A glass ball and a mirror block under a small light: caustics on the floor and the walls."
    ),
    scene!(
        "cornell-box",
        "Two blocks in a room with coloured walls: plain diffuse light transport."
    ),
    scene!(
        "mis-plates",
        "Plates from nearly smooth to rough under balls of light from small to large, after Veach \
         and Guibas 1995: neither sampling the light nor the surface does for all."
    ),
    scene!(
        "ajar-door",
        "A room lit only through a door that stands ajar, after Veach and Guibas 1997: nearly all \
         light is indirect and hard to find.",
        "models/egg.obj" => models::egg,
        "models/vase.obj" => models::vase
    ),
    scene!(
        "glass-lamp",
        "A small light inside a closed bulb of glass: everything is lit by caustics, and the \
         mirror ball sees them (SDS paths).",
        "models/bulb.obj" => models::bulb
    ),
    scene!(
        "ring-caustic",
        "A polished ring on a table: the light reflected inside it gathers on a curve between \
         nephroid and cardioid.",
        "models/ring.obj" => models::ring
    ),
    scene!(
        "furnace",
        "A ball of reflectance ρ under the constant environment 1: its radiance is ρ everywhere."
    ),
    scene!(
        "integrating-sphere",
        "Inside a sphere of uniform emission L_e and reflectance ρ: the radiance is L_e/(1−ρ)."
    ),
    scene!(
        "concentric-spheres",
        "Between a luminous sphere and one around it: radiosities of 1.0891089 and 0.2970297."
    ),
    scene!(
        "kajiya",
        "Grey bodies and green balls of glass on a reddish ground, after figure 6 of Kajiya 1986.",
        "models/column.obj" => models::column
    ),
    scene!(
        "glass-egg",
        "A floor lamp, a narrow beam into a glass egg and a covered wall light, after Veach and \
         Guibas 1994: caustics and indirect light at once.",
        "models/bowl.obj" => models::bowl,
        "models/tube.obj" => models::tube,
        "models/egg.obj" => models::egg
    ),
    scene!(
        "water-pool",
        "Tiles under wavy water: caustics seen through the surface that makes them.",
        "models/water.obj" => models::water,
        "models/light-tiles.obj" => models::light_tiles,
        "models/dark-tiles.obj" => models::dark_tiles
    ),
    scene!(
        "thin-lens",
        "Balls and lamps before a wide lens: light paths can end on the lens itself (t = 0)."
    ),
    scene!("fog-box", "The room with two blocks, full of fog that scatters forward."),
    scene!(
        "volumetric-caustic",
        "A spotlight on a ball of glass in fog: light that goes through glass, fog and to the eye, \
         which path tracing never finds."
    ),
    scene!("env-ball", "Mirror, glass, brushed and matte balls on a disk under a constant sky."),
    scene!(
        "smooth-shading",
        "Coarse meshes with smooth normals in grazing light: the adjoint factor of shading normals \
         decides whether light and path tracing agree.",
        "models/coarse-ball.obj" => models::coarse_ball,
        "models/coarse-torus.obj" => models::coarse_torus
    ),
];
