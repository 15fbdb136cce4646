//! The three real scenes, in the versions of Mitsuba 3 and of Mitsuba 0.5.

use std::path::PathBuf;

use pathspace_core::description::{
    FilterKind, MaterialKind, MicrofacetKind, SceneDescription, ShapeGeometry,
};
use pathspace_scenes::{LoadedScene, load};

/// The scene, or nothing where the shared files are absent.
fn shared(name: &str) -> Option<LoadedScene> {
    let root = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/scenes"));
    let path = root.join(name);
    if !path.is_file() {
        eprintln!("skipped: {} is not here", path.display());
        return None;
    }
    Some(load(&path, &[]).unwrap_or_else(|e| panic!("{e}")))
}

fn triangles(scene: &SceneDescription) -> usize {
    let count = |g: &ShapeGeometry| match g {
        ShapeGeometry::Mesh(mesh) => mesh.triangles.len(),
        _ => 0,
    };
    scene.shapes.iter().map(|s| count(&s.geometry)).sum()
}

#[test]
fn cornell_box_is_read() {
    let Some(loaded) = shared("cornell-box/scene.xml") else { return };
    let scene = &loaded.description;
    assert_eq!(loaded.name, "cornell-box");
    assert_eq!(loaded.defaults.integrator.as_deref(), Some("pt"));
    assert_eq!(loaded.defaults.max_depth, Some(65));
    assert_eq!(loaded.defaults.spp, Some(64));
    assert_eq!(scene.shapes.len(), 8);
    assert_eq!(scene.materials.len(), 8);
    assert_eq!((scene.film.width, scene.film.height), (1024, 1024));
    assert_eq!(scene.film.filter, FilterKind::Tent { radius: 1.0 });
    assert_eq!(scene.sensor.fov_x_degrees, 19.5);
    assert_eq!(scene.sensor.to_world.translation.to_array(), [0.0, 1.0, 6.8]);
    let light = scene.shapes.iter().find(|s| s.emission.is_some()).unwrap();
    assert_eq!(light.emission.unwrap().to_array(), [17.0, 12.0, 4.0]);
    assert!(matches!(scene.materials[light.material].kind, MaterialKind::TwoSided { .. }));
}

#[test]
fn veach_mis_is_read() {
    let Some(loaded) = shared("veach-mis/scene.xml") else { return };
    let scene = &loaded.description;
    assert_eq!(scene.shapes.len(), 9);
    let lights: Vec<f32> = scene.shapes.iter().filter_map(|s| s.emission.map(|e| e.r)).collect();
    assert_eq!(lights, [7.59909, 30.3964, 3039.64]);
    let rough = scene.materials.iter().find(|m| m.name == "Rough").unwrap();
    let MaterialKind::TwoSided { front, .. } = &rough.kind else { panic!("{rough:?}") };
    let MaterialKind::RoughConductor { distribution, alpha_u, alpha_v, .. } = **front else {
        panic!("{front:?}")
    };
    assert_eq!((distribution, alpha_u, alpha_v), (MicrofacetKind::Beckmann, 0.1, 0.1));
}

#[test]
fn veach_bidir_is_read_with_its_meshes() {
    let Some(loaded) = shared("veach-bidir/scene.xml") else { return };
    let scene = &loaded.description;
    assert_eq!(scene.shapes.len(), 14);
    assert!(triangles(scene) > 10_000, "{}", triangles(scene));
    let faceted = |s: &&pathspace_core::description::ShapeDescription| match &s.geometry {
        ShapeGeometry::Mesh(mesh) => mesh.normals.is_empty(),
        _ => false,
    };
    assert_eq!(scene.shapes.iter().filter(faceted).count(), 5);
}

#[test]
fn files_of_version_0_5_give_the_same_scenes() {
    for name in ["cornell-box", "veach-mis", "veach-bidir"] {
        let (Some(new), Some(old)) =
            (shared(&format!("{name}/scene.xml")), shared(&format!("{name}/scene_v0.5.xml")))
        else {
            return;
        };
        assert_eq!(old.defaults, new.defaults, "{name}");
        assert_eq!(old.name, new.name);
        let (mut a, b) = (old.description, new.description);
        // The newer files give the exponents with fewer digits; everything else is the same.
        for (x, y) in a.shapes.iter_mut().zip(&b.shapes) {
            x.name = y.name.clone();
        }
        assert_eq!(format!("{a:?}"), format!("{b:?}"), "{name}");
    }
}
