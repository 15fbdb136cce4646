//! What every scene and every mesh of the library must satisfy.

use std::collections::{BTreeSet, HashMap};
use std::fs;
use std::path::PathBuf;

use glam::{DVec3, Vec3};

use super::mesh::Mesh;
use super::{LibraryError, all, find, models};

/// An empty directory of its own for a test, removed at the end.
struct Scratch(PathBuf);

impl Scratch {
    fn new(test: &str) -> Self {
        let name = format!("pathspace-library-{test}-{}", std::process::id());
        let path = std::env::temp_dir().join(name);
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).unwrap();
        Scratch(path)
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

#[test]
fn names_are_unique_and_found() {
    let names: BTreeSet<_> = all().iter().map(|scene| scene.name).collect();
    assert_eq!(names.len(), all().len());
    for name in names {
        assert_eq!(find(name).unwrap().name, name);
    }
    assert!(find("no-such-scene").is_none());
}

#[test]
fn every_scene_is_well_formed_and_has_exactly_the_files_it_refers_to() {
    for scene in all() {
        let document = roxmltree::Document::parse(scene.xml()).unwrap();
        let referred: BTreeSet<String> = document
            .descendants()
            .filter(|node| node.attribute("name") == Some("filename"))
            .map(|node| node.attribute("value").unwrap().to_string())
            .collect();
        let meshes: BTreeSet<String> = scene.meshes().map(|(path, _)| path.to_string()).collect();
        assert_eq!(referred, meshes, "{}", scene.name);
    }
}

#[test]
fn every_scene_loads_without_notes() {
    for scene in all() {
        let loaded = scene.load(&[]).unwrap_or_else(|error| panic!("{}: {error}", scene.name));
        assert!(loaded.notes.is_empty(), "{}: {:?}", scene.name, loaded.notes);
        assert_eq!(loaded.name, scene.name);
        assert_eq!((loaded.description.film.width, loaded.description.film.height), (256, 256));
    }
}

#[test]
fn every_scene_builds() {
    for scene in all() {
        let description = scene.load(&[]).unwrap().description;
        let built = pathspace_core::Scene::new(&description);
        assert!(built.is_ok(), "{}: {}", scene.name, built.err().unwrap());
    }
}

#[test]
fn every_scene_obeys_the_common_parameters() {
    let params = [("res", "32"), ("spp", "7"), ("max_depth", "3"), ("integrator", "ptracer")]
        .map(|(key, value)| (key.to_string(), value.to_string()));
    for scene in all() {
        let loaded = scene.load(&params).unwrap();
        assert_eq!(loaded.description.film.width, 32, "{}", scene.name);
        assert_eq!(loaded.defaults.max_depth, Some(3), "{}", scene.name);
    }
}

#[test]
fn a_scene_from_memory_is_the_exported_one() {
    let scratch = Scratch::new("same");
    for scene in all() {
        scene.export(&scratch.0.join(scene.name)).unwrap();
        let exported = scratch.0.join(scene.name).join("scene.xml");
        let from_disk = crate::load(&exported, &[]).unwrap();
        assert_eq!(from_disk.hash, scene.load(&[]).unwrap().hash, "{}", scene.name);
    }
}

#[test]
fn export_writes_the_files_and_nothing_else() {
    let scratch = Scratch::new("export");
    let scene = find("ajar-door").unwrap();
    let dir = scratch.0.join("new/deep");
    // Twice: the second time replaces the files of the first.
    for _ in 0..2 {
        let paths = scene.export(&dir).unwrap();
        assert_eq!(paths[0], dir.join("scene.xml"));
        for (file, path) in scene.files().iter().zip(&paths) {
            assert_eq!(fs::read(path).unwrap(), file.bytes);
        }
    }
    let count = |dir: PathBuf| fs::read_dir(dir).unwrap().count();
    assert_eq!((count(dir.clone()), count(dir.join("models"))), (2, 2));
}

#[test]
fn export_to_a_place_that_is_a_file_says_so_in_one_line() {
    let scratch = Scratch::new("file");
    let place = scratch.0.join("taken");
    fs::write(&place, "").unwrap();
    let error = find("furnace").unwrap().export(&place).unwrap_err();
    assert!(matches!(&error, LibraryError::CreateDirectory { path, .. } if *path == place));
    let message = error.to_string();
    assert!(message.contains("taken") && !message.contains('\n'), "{message}");
}

#[test]
fn a_failed_export_leaves_no_temporary_file() {
    let scratch = Scratch::new("failed");
    // A directory in the place of the file: the file is written but cannot be renamed.
    fs::create_dir_all(scratch.0.join("scene.xml/in-the-way")).unwrap();
    let error = find("furnace").unwrap().export(&scratch.0).unwrap_err();
    assert!(matches!(error, LibraryError::WriteFile { .. }));
    assert_eq!(fs::read_dir(&scratch.0).unwrap().count(), 1);
}

#[test]
fn normals_are_unit_and_on_the_front_of_their_triangles() {
    for (path, mesh) in all().iter().flat_map(|scene| scene.meshes()) {
        for normal in &mesh.normals {
            assert!((normal.as_dvec3().length() - 1.0).abs() < 2e-7, "{path}");
        }
        for (i, corners) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = mesh.corners(i).map(Vec3::as_dvec3);
            let geometric = (b - a).cross(c - a);
            assert!(geometric.length() > 0.0, "{path}: triangle {i} has no area");
            for (_, n) in corners {
                let cosine = geometric.normalize().dot(mesh.normals[*n as usize].as_dvec3());
                assert!(cosine > 0.3, "{path}: triangle {i}, cosine {cosine}");
            }
        }
    }
}

#[test]
fn numbers_in_the_obj_read_back_as_the_same_bits() {
    for (path, mesh) in all().iter().flat_map(|scene| scene.meshes()) {
        let text = mesh.to_obj();
        for (key, values) in [("v ", &mesh.positions), ("vn ", &mesh.normals)] {
            let read: Vec<Vec3> = text
                .lines()
                .filter_map(|line| line.strip_prefix(key))
                .map(|line| {
                    let mut numbers = line.split(' ').map(|word| word.parse::<f32>().unwrap());
                    Vec3::from_array(std::array::from_fn(|_| numbers.next().unwrap()))
                })
                .collect();
            assert!(read == *values, "{path}: {key}");
        }
    }
}

/// Every directed edge occurs once and its reverse once.
fn closed(mesh: &Mesh) -> bool {
    let mut edges: HashMap<(u32, u32), u32> = HashMap::new();
    for corners in &mesh.triangles {
        for i in 0..3 {
            *edges.entry((corners[i].0, corners[(i + 1) % 3].0)).or_default() += 1;
        }
    }
    edges.iter().all(|(&(a, b), &count)| count == 1 && edges.get(&(b, a)) == Some(&1))
}

#[test]
fn an_open_mesh_is_not_taken_for_closed() {
    let mut mesh = models::egg();
    assert!(closed(&mesh));
    mesh.triangles.pop();
    assert!(!closed(&mesh));
    let mut mesh = models::egg();
    mesh.triangles[7].swap(0, 1);
    assert!(!closed(&mesh));
}

#[test]
fn bodies_are_closed_and_face_outward() {
    for (path, mesh) in all().iter().flat_map(|scene| scene.meshes()) {
        if OPEN.contains(&path) {
            continue;
        }
        assert!(closed(&mesh), "{path}");
        assert!(mesh.signed_volume() > 0.0, "{path}");
    }
}

/// Meshes that are sheets by intention.
const OPEN: [&str; 3] = ["models/water.obj", "models/light-tiles.obj", "models/dark-tiles.obj"];

#[test]
fn the_bulb_is_a_thin_shell() {
    let mesh = models::bulb();
    let area: f64 = (0..mesh.triangles.len())
        .map(|i| {
            let [a, b, c] = mesh.corners(i).map(Vec3::as_dvec3);
            0.5 * (b - a).cross(c - a).length()
        })
        .sum();
    // Volume = wall thickness × area of the surface half-way: outer and inner sheet are one each.
    let thickness = mesh.signed_volume() / (0.5 * area);
    assert!((thickness - 0.008).abs() < 1e-4, "{thickness}");
    // The light's ball, 0.025 about a point 0.02 below the origin, is well inside the cavity.
    let light = DVec3::new(0.0, -0.02, 0.0);
    assert!(mesh.positions.iter().all(|p| p.as_dvec3().distance(light) > 0.1));
}

#[test]
fn the_egg_has_the_volume_of_its_profile() {
    // V = π∫r² dy with r = 0.09 c (1 − 0.16 s), y = 0.12 (1 + s), s in [−1,1], c² = 1 − s²:
    // π·0.0081·0.12·∫(1 − s²)(1 + 0.0256 s²) ds = π·0.000972·(4/3 + 0.0256·4/15).
    let exact = std::f64::consts::PI * 0.000972 * (4.0 / 3.0 + 0.0256 * 4.0 / 15.0);
    let volume = models::egg().signed_volume();
    assert!((volume / exact - 1.0).abs() < 3e-3, "{volume} {exact}");
}
