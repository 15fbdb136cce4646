//! Triangle meshes: OBJ and PLY files, vertex normals, and what is mended on the way.

mod finish;
mod normals;
mod obj;
mod ply;
mod serialized;

pub(crate) use finish::{Options, finish};
pub(crate) use obj::read_obj;
pub(crate) use ply::read_ply;
pub(crate) use serialized::read_serialized;

/// A mesh as the file gives it; polygons are triangulated as fans.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct RawMesh {
    pub(crate) positions: Vec<[f32; 3]>,
    /// Empty, or one for each position; not normalised.
    pub(crate) normals: Vec<[f32; 3]>,
    /// Empty, or one for each position.
    pub(crate) uvs: Vec<[f32; 2]>,
    /// Indices below the number of positions.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// The file wants it faceted.
    pub(crate) face_normals: bool,
    /// What was odd about the file, one line each.
    pub(crate) notes: Vec<String>,
}
