//! Surfaces.
//!
//! How normals, flips and mirrored transforms act is Mitsuba 3.9.1's, measured by rays against
//! every shape (side that emits, front of the bsdf):
//!
//! - rectangle, cube, disk: the normal is transformed as a normal (inverse transpose), also where
//!   `to_world` mirrors;
//! - sphere: outward, but inward where `to_world` mirrors;
//! - cylinder: outward, also where `to_world` mirrors;
//! - meshes with vertex normals from the file: the side of the transformed vertex normals;
//! - meshes with computed normals or `face_normals`: the side from which the transformed
//!   triangle is counter-clockwise, so a mirrored mesh is turned inside out;
//! - `flip_normals` turns all of them round.

use std::sync::Arc;

use glam::{DAffine3, DVec3};
use pathspace_core::Rgb;
use pathspace_core::description::{MaterialKind, ShapeDescription, ShapeGeometry};

use super::props::Props;
use super::{Context, emitter, support, tube};
use crate::error::{Place, Result, SceneFileError};
use crate::mesh::{self, RawMesh};
use crate::note::NoteKind;

/// A shape and how its material is given.
pub(super) struct Shape {
    pub(super) description: ShapeDescription,
    pub(super) material: Material,
    /// Index of the medium behind the normal and before it, where it bounds one.
    pub(super) media: Option<[Option<usize>; 2]>,
}

/// Material of a shape.
pub(super) enum Material {
    /// The bsdf with this index.
    Object(usize),
    /// None is given.
    Default(MaterialKind),
}

/// Reads the shape with this index, which stands in a group that `outer` moves into the world.
///
/// `None` for a mesh without area, which nothing can see.
pub(super) fn read(
    context: &mut Context<'_>,
    index: usize,
    outer: &DAffine3,
) -> Result<Option<Shape>> {
    let object = &context.graph.objects[index];
    let mut props = Props::new(context.graph, object);
    let own = props.transform("to_world")?.unwrap_or(DAffine3::IDENTITY);
    let mut to_world = *outer * own;
    let mut flip_normals = props.boolean("flip_normals")?.unwrap_or(false);
    let geometry = match object.plugin.as_str() {
        plain @ ("rectangle" | "cube") => {
            // Both are flat already.
            props.boolean("face_normals")?;
            if plain == "cube" { ShapeGeometry::Cube } else { ShapeGeometry::Rectangle }
        }
        "disk" => ShapeGeometry::Disk,
        "sphere" => {
            flip_normals ^= to_world.matrix3.determinant() < 0.0;
            sphere(context, &mut props, &mut to_world)?
        }
        "cylinder" => cylinder(context, &mut props, &to_world)?,
        "obj" | "ply" | "serialized" => match mesh_file(context, &mut props, &to_world)? {
            Some(mesh) => mesh,
            None => return Ok(None),
        },
        _ => return Err(support::unknown(object)),
    };
    let emission = match props.nested_one("emitter")? {
        Some(index) => Some(emitter::read_area(context, index)?),
        None => None,
    };
    let media = [props.named("interior", "medium")?, props.named("exterior", "medium")?];
    let media = media.iter().any(Option::is_some).then_some(media);
    let graph = context.graph;
    let sensor = |index: usize| graph.objects[index].class == "sensor";
    for p in &object.properties {
        if graph.target(p)?.is_some_and(sensor) {
            props.nested("sensor")?;
            context.note(NoteKind::Ignored, "a sensor on a shape makes no image", &p.place);
        }
    }
    let material = match props.nested_one("bsdf")? {
        Some(index) => Material::Object(index),
        // In files of 0.x a boundary without a bsdf is index-matched.
        None if object.old && media.is_some() => Material::Default(MaterialKind::Null),
        // Mitsuba's default is grey 0.5, but black under an emitter.
        None => {
            let reflectance = Rgb::grey(if emission.is_some() { 0.0 } else { 0.5 });
            Material::Default(MaterialKind::Diffuse { reflectance })
        }
    };
    props.finish(context)?;
    let name = object.name();
    let description =
        ShapeDescription { name, geometry, to_world, flip_normals, material: 0, emission };
    Ok(Some(Shape { description, material, media }))
}

/// `center` and `radius`. A transform that stretches makes no ellipsoid: as in Mitsuba the radius
/// is that along the own x axis.
fn sphere(
    context: &mut Context<'_>,
    props: &mut Props<'_>,
    to_world: &mut DAffine3,
) -> Result<ShapeGeometry> {
    let center = props.vector("center")?.unwrap_or(DVec3::ZERO);
    let radius = props.positive("radius")?.unwrap_or(1.0);
    let m = to_world.matrix3;
    let gram = m.transpose() * m;
    let scale2 = (gram.x_axis.x + gram.y_axis.y + gram.z_axis.z) / 3.0;
    let off = (gram - glam::DMat3::from_diagonal(DVec3::splat(scale2))).to_cols_array();
    if off.iter().any(|v| v.abs() > 1e-4 * scale2) {
        let text =
            "a stretched sphere stays a sphere, with the radius along its x axis, as in Mitsuba";
        context.note(NoteKind::Mended, text, props.place());
        let middle = to_world.transform_point3(center);
        let x = m.x_axis.normalize();
        let y = (m.y_axis - x * m.y_axis.dot(x)).normalize();
        let z = x.cross(y) * m.determinant().signum();
        let matrix3 = glam::DMat3::from_cols(x, y, z) * m.x_axis.length();
        *to_world = DAffine3 { matrix3, translation: middle - matrix3 * center };
    }
    Ok(ShapeGeometry::Sphere { center, radius })
}

/// `p0`, `p1` and `radius`. What the transform makes elliptic or slanted becomes a mesh.
fn cylinder(
    context: &mut Context<'_>,
    props: &mut Props<'_>,
    to_world: &DAffine3,
) -> Result<ShapeGeometry> {
    let p0 = props.vector("p0")?.unwrap_or(DVec3::ZERO);
    let p1 = props.vector("p1")?.unwrap_or(DVec3::Z);
    let radius = props.positive("radius")?.unwrap_or(1.0);
    if p0 == p1 {
        return Err(props.complain("p1", "the ends of a cylinder must be apart"));
    }
    let axis = (p1 - p0).normalize();
    let (x, y) = axis.any_orthonormal_pair();
    let [u, v, a] = [x, y, axis].map(|e| to_world.transform_vector3(e));
    let (lengths, skew) = ((u.length() - v.length()).abs(), u.dot(v).abs());
    let slant = u.dot(a).abs().max(v.dot(a).abs());
    if lengths > 1e-4 * u.length()
        || skew > 1e-4 * u.length_squared()
        || slant > 1e-4 * u.length() * a.length()
    {
        let text = format!(
            "a cylinder that to_world makes elliptic or slanted is a mesh of {} triangles",
            2 * tube::SEGMENTS
        );
        context.note(NoteKind::Mended, text, props.place());
        let mirrored = to_world.matrix3.determinant() < 0.0;
        return Ok(ShapeGeometry::Mesh(Arc::new(tube::mesh(p0, p1, radius, mirrored))));
    }
    Ok(ShapeGeometry::Cylinder { p0, p1, radius })
}

fn mesh_file(
    context: &mut Context<'_>,
    props: &mut Props<'_>,
    to_world: &DAffine3,
) -> Result<Option<ShapeGeometry>> {
    let Some(name) = props.string("filename")? else {
        return Err(props.error("needs the property \"filename\""));
    };
    let kind = props.object.plugin.as_str();
    let is_obj = kind == "obj";
    let mut face_normals = props.boolean("face_normals")?.unwrap_or(false);
    // OBJ files have v upwards; Mitsuba turns it by default for OBJ and not for PLY.
    let flip_v = props.boolean("flip_tex_coords")?.unwrap_or(is_obj);
    if props.object.old {
        // Vertices at an angle larger than this are split in Mitsuba 0.5.
        if props.float("max_smooth_angle")?.is_some() {
            let text = "property \"max_smooth_angle\" is ignored: no edge is split";
            context.note(NoteKind::Differs, text, props.place());
        }
        props.ignore(context, &["collapse"], "each element makes one mesh");
    }
    let index = match kind {
        "serialized" => props.count("shape_index", 0, u32::MAX)?.unwrap_or(0),
        _ => 0,
    };
    let raw = read_mesh(context, props, name, index)?;
    face_normals |= raw.face_normals;
    let mut notes = Vec::new();
    let options = mesh::Options { face_normals, flip_v };
    let data = mesh::finish(&raw, to_world, &options, &mut notes).map_err(|reason| {
        let reason = format!("mesh \"{name}\": {reason}");
        SceneFileError::Mesh { place: props.place().clone(), reason }
    })?;
    for note in notes {
        context.note(NoteKind::Mended, format!("mesh \"{name}\": {note}"), props.place());
    }
    Ok((!data.triangles.is_empty()).then(|| ShapeGeometry::Mesh(Arc::new(data))))
}

fn read_mesh(
    context: &mut Context<'_>,
    props: &Props<'_>,
    name: &str,
    index: u32,
) -> Result<Arc<RawMesh>> {
    let path = context.files.resolve(name);
    if let Some(mesh) = context.meshes.get(&(path.clone(), index)) {
        return Ok(mesh.clone());
    }
    let file = path.display().to_string();
    let raw = match props.object.plugin.as_str() {
        "serialized" => {
            let bytes = context.shared_file(&path, props.place())?;
            mesh::read_serialized(&bytes, index).map_err(|reason| SceneFileError::Mesh {
                place: Place::file(file),
                reason: format!("mesh {index}: the file {reason}"),
            })?
        }
        kind => {
            let bytes = context.files.read(&path, props.place())?;
            context.files.hash(&bytes);
            if kind == "obj" {
                mesh::read_obj(bytes, &file)?
            } else {
                mesh::read_ply(&bytes, &file)?
            }
        }
    };
    let raw = Arc::new(raw);
    context.meshes.insert((path, index), raw.clone());
    Ok(raw)
}
