//! Texture coordinates of the shapes, against Mitsuba 3.9.1 on the same rays.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};
use pathspace_core::description::*;
use pathspace_core::math::Ray;

use crate::emitters::{emitters, inside};

/// (u, v) where a ray of world space meets the shape.
fn uv(geometry: &ShapeGeometry, to_world: DAffine3, o: DVec3, d: DVec3) -> [f32; 2] {
    let scene = emitters(Some((geometry, to_world, false)), Vec::new());
    let point = scene.intersect(&Ray::new(inside(&scene, o), d.normalize().as_vec3())).unwrap();
    scene.uv(&point).to_array()
}

fn assert_near(name: &str, found: [f32; 2], expected: [f32; 2]) {
    let off = (Vec3::from((found[0], found[1], 0.0)) - Vec3::from((expected[0], expected[1], 0.0)))
        .length();
    assert!(off < 2e-5, "{name}: {found:?} {expected:?}");
}

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

#[test]
fn flat_shapes() {
    let id = DAffine3::IDENTITY;
    let down = |g: &ShapeGeometry, x, y| uv(g, id, v(x, y, 2.0), v(0.0, 0.0, -1.0));
    assert_near("rectangle", down(&ShapeGeometry::Rectangle, 0.3, 0.5), [0.65, 0.75]);
    assert_near("rectangle", down(&ShapeGeometry::Rectangle, -0.5, 0.3), [0.25, 0.65]);
    assert_near("disk", down(&ShapeGeometry::Disk, 0.3, 0.4), [0.5, 0.14758]);
    assert_near("disk", down(&ShapeGeometry::Disk, 0.3, -0.4), [0.5, 0.85242]);
    for (axis, o, expected) in [
        ("-x", v(-3.0, 0.3, 0.5), [0.65, 0.75]),
        ("+x", v(3.0, 0.3, 0.5), [0.65, 0.25]),
        ("-y", v(0.3, -3.0, 0.5), [0.75, 0.65]),
        ("+y", v(0.3, 3.0, 0.5), [0.35, 0.25]),
        ("-z", v(0.3, 0.5, -3.0), [0.25, 0.65]),
        ("+z", v(0.3, 0.5, 3.0), [0.75, 0.65]),
    ] {
        let across = o.abs().max_element() == o.abs().x;
        let d = if across {
            v(-o.x, 0.0, 0.0)
        } else if o.abs().max_element() == o.abs().y {
            v(0.0, -o.y, 0.0)
        } else {
            v(0.0, 0.0, -o.z)
        };
        assert_near(axis, uv(&ShapeGeometry::Cube, id, o, d), expected);
    }
}

#[test]
fn spheres() {
    let sphere = ShapeGeometry::Sphere { center: DVec3::ZERO, radius: 1.0 };
    for (o, expected) in [
        (v(2.0, 1.0, 0.5), [0.07379, 0.42998]),
        (v(-2.0, 1.0, 0.5), [0.42621, 0.42998]),
        (v(-2.0, -1.0, -0.5), [0.57379, 0.57002]),
        (v(1.0, -2.0, -0.7), [0.82379, 0.59657]),
    ] {
        assert_near("sphere", uv(&sphere, DAffine3::IDENTITY, o, -o), expected);
    }
    let turned = DAffine3::from_rotation_x(PI / 2.0);
    let o = v(2.0, 1.0, 0.5);
    assert_near("turned sphere", uv(&sphere, turned, o, -o), [0.03899, 0.64376]);
}

#[test]
fn cylinders() {
    let of = |p0, p1, o: DVec3, d| {
        uv(&ShapeGeometry::Cylinder { p0, p1, radius: 1.0 }, DAffine3::IDENTITY, o, d)
    };
    for (o, up, down, along) in [
        (v(2.0, 1.0, 0.25), [0.07379, 0.25], [0.92621, 0.75], [0.32379, 0.25]),
        (v(-2.0, 1.0, 0.25), [0.42621, 0.25], [0.57379, 0.75], [0.67621, 0.25]),
        (v(1.0, -2.0, 0.75), [0.82379, 0.75], [0.17621, 0.25], [0.07379, 0.75]),
    ] {
        let d = v(-o.x, -o.y, 0.0);
        assert_near("z", of(DVec3::ZERO, DVec3::Z, o, d), up);
        assert_near("-z", of(DVec3::Z, DVec3::ZERO, o, d), down);
        let (o, d) = (v(o.z, o.x, o.y), v(0.0, d.x, d.y));
        assert_near("x", of(DVec3::ZERO, DVec3::X, o, d), along);
    }
}

#[test]
fn meshes_with_and_without_coordinates() {
    let mut mesh = MeshData {
        positions: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        triangles: vec![[0, 1, 2]],
        ..MeshData::default()
    };
    let at = |mesh: &MeshData| {
        let geometry = ShapeGeometry::Mesh(Arc::new(mesh.clone()));
        uv(&geometry, DAffine3::IDENTITY, v(0.2, 0.3, 1.0), v(0.0, 0.0, -1.0))
    };
    assert_near("barycentric", at(&mesh), [0.2, 0.3]);
    mesh.uvs = vec![[1.0, 2.0], [3.0, 2.0], [1.0, -2.0]];
    assert_near("given", at(&mesh), [1.4, 0.8]);
}
