//! Scenes written in code: a few lines a shape, for exact answers and tests.

use std::sync::Arc;

use glam::{DAffine3, DMat3, DQuat, DVec3};
use pathspace_core::Rgb;
use pathspace_core::description::{
    BoundaryDescription, EmitterDescription, FilmDescription, MaterialDescription, MaterialKind,
    MediumDescription, MediumKind, MeshData, PhaseKind, SceneDescription, SensorDescription,
    ShapeDescription, ShapeGeometry,
};

/// A [`SceneDescription`] under construction. Methods that add a shape give it back for further
/// settings (`emission`, `flip_normals`).
#[derive(Clone, Debug, Default)]
pub struct SceneBuilder {
    description: SceneDescription,
}

impl SceneBuilder {
    /// An empty scene with a square film of `size` pixels a side.
    pub fn new(size: u32) -> Self {
        let film = FilmDescription::new(size, size);
        SceneBuilder { description: SceneDescription { film, ..SceneDescription::default() } }
    }

    /// The finished description.
    pub fn finish(self) -> SceneDescription {
        self.description
    }

    /// The description so far.
    pub fn description(&mut self) -> &mut SceneDescription {
        &mut self.description
    }

    /// Adds a material and gives its index.
    pub fn material(&mut self, kind: MaterialKind) -> usize {
        let index = self.description.materials.len();
        let name = format!("material {index}");
        self.description.materials.push(MaterialDescription { name, kind });
        index
    }

    /// Adds a grey Lambertian material of reflectance `rho`.
    pub fn diffuse(&mut self, rho: f32) -> usize {
        self.material(MaterialKind::Diffuse { reflectance: Rgb::grey(rho) })
    }

    /// Adds a smooth dielectric of index `int_ior` in vacuum.
    pub fn glass(&mut self, int_ior: f32) -> usize {
        self.material(MaterialKind::Dielectric {
            int_ior,
            ext_ior: 1.0,
            specular_reflectance: Rgb::WHITE,
            specular_transmittance: Rgb::WHITE,
        })
    }

    /// Adds a smooth mirror that reflects `rho` at every angle.
    pub fn mirror(&mut self, rho: f32) -> usize {
        self.material(MaterialKind::Conductor {
            eta: Rgb::BLACK,
            k: Rgb::WHITE,
            specular_reflectance: Rgb::grey(rho),
        })
    }

    /// Adds any shape.
    pub fn shape(
        &mut self,
        geometry: ShapeGeometry,
        to_world: DAffine3,
        material: usize,
    ) -> &mut ShapeDescription {
        let shapes = &mut self.description.shapes;
        let index = shapes.len();
        shapes.push(ShapeDescription {
            name: format!("shape {index}"),
            geometry,
            to_world,
            flip_normals: false,
            material,
            emission: None,
        });
        &mut shapes[index]
    }

    /// Adds the parallelogram `corner` + a·`u` + b·`v`, a and b in [0, 1], with normal u × v.
    pub fn rectangle(
        &mut self,
        corner: DVec3,
        u: DVec3,
        v: DVec3,
        material: usize,
    ) -> &mut ShapeDescription {
        let matrix = DMat3::from_cols(0.5 * u, 0.5 * v, u.cross(v).normalize());
        let to_world = DAffine3 { matrix3: matrix, translation: corner + 0.5 * (u + v) };
        self.shape(ShapeGeometry::Rectangle, to_world, material)
    }

    /// Adds a sphere.
    pub fn sphere(&mut self, center: DVec3, radius: f64, material: usize) -> &mut ShapeDescription {
        self.shape(ShapeGeometry::Sphere { center, radius }, DAffine3::IDENTITY, material)
    }

    /// Adds the side of a cylinder about the segment from `p0` to `p1`, normals outward.
    pub fn cylinder(
        &mut self,
        p0: DVec3,
        p1: DVec3,
        radius: f64,
        material: usize,
    ) -> &mut ShapeDescription {
        let geometry = ShapeGeometry::Cylinder { p0, p1, radius };
        self.shape(geometry, DAffine3::IDENTITY, material)
    }

    /// Adds a disk with unit normal `normal`.
    pub fn disk(
        &mut self,
        center: DVec3,
        normal: DVec3,
        radius: f64,
        material: usize,
    ) -> &mut ShapeDescription {
        let to_world = DAffine3::from_scale_rotation_translation(
            DVec3::splat(radius),
            DQuat::from_rotation_arc(DVec3::Z, normal.normalize()),
            center,
        );
        self.shape(ShapeGeometry::Disk, to_world, material)
    }

    /// Adds a mesh in world space.
    pub fn mesh(&mut self, mesh: MeshData, material: usize) -> &mut ShapeDescription {
        self.shape(ShapeGeometry::Mesh(Arc::new(mesh)), DAffine3::IDENTITY, material)
    }

    /// Adds a homogeneous medium and gives its index; `extinction` per unit of length.
    pub fn medium(&mut self, extinction: [f64; 3], albedo: Rgb, phase: PhaseKind) -> usize {
        let media = &mut self.description.media.media;
        let kind = MediumKind::Homogeneous { extinction, albedo };
        media.push(MediumDescription { name: format!("medium {}", media.len()), kind, phase });
        media.len() - 1
    }

    /// Fills the last shape with a medium.
    pub fn filled_with(&mut self, medium: usize) {
        let shape = self.description.shapes.len() - 1;
        let boundary = BoundaryDescription { shape, interior: Some(medium), exterior: None };
        self.description.media.boundaries.push(boundary);
    }

    /// Says that the sensor stands in a medium.
    pub fn sensor_in(&mut self, medium: usize) {
        self.description.media.sensor = Some(medium);
    }

    /// Adds an emitter that is no surface.
    pub fn emitter(&mut self, emitter: EmitterDescription) {
        self.description.emitters.push(emitter);
    }

    /// Sets a pinhole at `origin` that looks at `target`, horizontal angle of view in degrees.
    pub fn look_at(
        &mut self,
        origin: DVec3,
        target: DVec3,
        up: DVec3,
        fov_x_degrees: f64,
    ) -> &mut SensorDescription {
        let z = (target - origin).normalize();
        let x = up.cross(z).normalize();
        let matrix = DMat3::from_cols(x, z.cross(x), z);
        self.description.sensor = SensorDescription {
            to_world: DAffine3 { matrix3: matrix, translation: origin },
            fov_x_degrees,
            ..SensorDescription::default()
        };
        &mut self.description.sensor
    }
}

/// A sphere of triangles about the origin (a subdivided octahedron) with smooth normals, which
/// differ from the geometric ones.
pub fn smooth_sphere(radius: f64, subdivisions: u32) -> MeshData {
    let octant = |a: DVec3, b: DVec3, c: DVec3| [a, b, c];
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let mut triangles = vec![
        octant(x, y, z),
        octant(y, -x, z),
        octant(-x, -y, z),
        octant(-y, x, z),
        octant(y, x, -z),
        octant(-x, y, -z),
        octant(-y, -x, -z),
        octant(x, -y, -z),
    ];
    for _ in 0..subdivisions {
        triangles = triangles
            .into_iter()
            .flat_map(|[a, b, c]| {
                let (ab, bc, ca) = ((a + b).normalize(), (b + c).normalize(), (c + a).normalize());
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    let corners: Vec<DVec3> = triangles.iter().flatten().copied().collect();
    MeshData {
        positions: corners.iter().map(|p| (*p * radius).as_vec3().to_array()).collect(),
        normals: corners.iter().map(|p| p.as_vec3().to_array()).collect(),
        uvs: Vec::new(),
        triangles: (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_of_the_sphere_face_outward() {
        let mesh = smooth_sphere(2.0, 2);
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| glam::Vec3::from(mesh.positions[i as usize]));
            assert!((b - a).cross(c - a).dot(a) > 0.0);
        }
        assert_eq!(mesh.triangles.len(), 128);
    }
}
