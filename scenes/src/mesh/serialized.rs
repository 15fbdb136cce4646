//! Mitsuba's `serialized` files: several compressed meshes in one file, versions 3 and 4.
//!
//! A mesh is a head of four bytes (0x041c and the version) and a zlib stream: flags, a name
//! (version 4), the numbers of vertices and triangles, positions, normals, texture coordinates and
//! colours as the flags say, and indices. At the end of the file stand the offsets of all meshes
//! and their number.

use std::io::Read;

use flate2::read::ZlibDecoder;

use super::RawMesh;

const HAS_NORMALS: u32 = 0x1;
const HAS_UVS: u32 = 0x2;
const HAS_COLOURS: u32 = 0x8;
const FACE_NORMALS: u32 = 0x10;
const DOUBLE: u32 = 0x2000;

/// Most vertices and most triangles: a stream of few bytes can unpack to many.
const MAX_COUNT: u64 = 1 << 28;

/// Longest name.
const MAX_NAME: usize = 4096;

/// The mesh with this index.
///
/// # Errors
/// What is wrong with the file, without its name.
pub(crate) fn read_serialized(bytes: &[u8], index: u32) -> Result<RawMesh, String> {
    let start = offset(bytes, index)?;
    let head = bytes.get(start..start + 4).ok_or("is shorter than the head of a mesh")?;
    check_magic(head)?;
    let version = u16::from_le_bytes([head[2], head[3]]);
    if !(3..=4).contains(&version) {
        return Err(format!("has version {version}; known are 3 and 4"));
    }
    let mut stream = Stream(ZlibDecoder::new(&bytes[start + 4..]));
    let flags = stream.u32()?;
    if version == 4 {
        stream.skip_name()?;
    }
    let (vertices, triangles) = (stream.u64()?, stream.u64()?);
    if vertices > MAX_COUNT || triangles > MAX_COUNT {
        return Err(format!(
            "has {vertices} vertices and {triangles} triangles, of which {MAX_COUNT} are allowed"
        ));
    }
    let double = flags & DOUBLE != 0;
    let n = vertices as usize;
    let mut mesh = RawMesh { positions: stream.vectors(n, double)?, ..RawMesh::default() };
    if flags & HAS_NORMALS != 0 {
        mesh.normals = stream.vectors(n, double)?;
    }
    if flags & HAS_UVS != 0 {
        mesh.uvs = stream.vectors(n, double)?;
    }
    if flags & HAS_COLOURS != 0 {
        stream.vectors::<3>(n, double)?;
        mesh.notes.push("vertex colours are not used".into());
    }
    mesh.triangles = stream.triangles(triangles as usize, vertices)?;
    check(&mut mesh)?;
    mesh.face_normals = flags & FACE_NORMALS != 0;
    Ok(mesh)
}

fn check_magic(head: &[u8]) -> Result<(), String> {
    match u16::from_le_bytes([head[0], head[1]]) {
        0x041c => Ok(()),
        other => {
            Err(format!("begins with {other:#06x} instead of 0x041c: it is no serialized mesh"))
        }
    }
}

/// Where the mesh begins; the first one begins the file, with or without a list of offsets.
fn offset(bytes: &[u8], index: u32) -> Result<usize, String> {
    if index == 0 {
        return Ok(0);
    }
    let head = bytes.get(..4).ok_or("is shorter than the head of a mesh")?;
    check_magic(head)?;
    let wide = u16::from_le_bytes([head[2], head[3]]) >= 4;
    let missing = || "has no complete list of offsets at its end".to_string();
    let end = bytes.len().checked_sub(4).ok_or_else(missing)?;
    let word = |at: usize| -> Result<u32, String> {
        let b = bytes.get(at..at + 4).ok_or_else(missing)?;
        Ok(u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
    };
    let count = word(end)?;
    if index >= count {
        return Err(format!("has {count} meshes: there is no shape_index {index}"));
    }
    let size = if wide { 8 } else { 4 };
    let entry = end.checked_sub(size * (count - index) as usize).ok_or_else(missing)?;
    let low = u64::from(word(entry)?);
    let high = if wide { u64::from(word(entry + 4)?) } else { 0 };
    match usize::try_from(low | high << 32) {
        Ok(at) if at < bytes.len() => Ok(at),
        _ => Err(format!("has an offset of mesh {index} beyond its end")),
    }
}

struct Stream<R>(R);

impl<R: Read> Stream<R> {
    /// `n` bytes; memory grows with what is really there.
    fn take(&mut self, n: usize) -> Result<Vec<u8>, String> {
        let mut out = Vec::new();
        let read = self.0.by_ref().take(n as u64).read_to_end(&mut out);
        match read {
            Ok(found) if found == n => Ok(out),
            Ok(_) => Err("ends before all of its mesh is there".into()),
            Err(e) => Err(format!("cannot be unpacked: {e}")),
        }
    }

    fn u32(&mut self) -> Result<u32, String> {
        let b = self.take(4)?;
        Ok(u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
    }

    fn u64(&mut self) -> Result<u64, String> {
        let (low, high) = (self.u32()?, self.u32()?);
        Ok(u64::from(low) | u64::from(high) << 32)
    }

    fn skip_name(&mut self) -> Result<(), String> {
        for _ in 0..MAX_NAME {
            if self.take(1)? == [0] {
                return Ok(());
            }
        }
        Err(format!("has a name of more than {MAX_NAME} bytes"))
    }

    fn vectors<const N: usize>(
        &mut self,
        count: usize,
        double: bool,
    ) -> Result<Vec<[f32; N]>, String> {
        let size = if double { 8 } else { 4 };
        let bytes = self.take(count * N * size)?;
        let number = |b: &[u8]| {
            if double {
                f64::from_le_bytes([b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]]) as f32
            } else {
                f32::from_le_bytes([b[0], b[1], b[2], b[3]])
            }
        };
        let vector = |b: &[u8]| std::array::from_fn(|i| number(&b[i * size..(i + 1) * size]));
        Ok(bytes.chunks_exact(N * size).map(vector).collect())
    }

    fn triangles(&mut self, count: usize, vertices: u64) -> Result<Vec<[u32; 3]>, String> {
        let bytes = self.take(count * 12)?;
        let index = |b: &[u8], i: usize| {
            u32::from_le_bytes([b[4 * i], b[4 * i + 1], b[4 * i + 2], b[4 * i + 3]])
        };
        let all: Vec<[u32; 3]> =
            bytes.chunks_exact(12).map(|b| [index(b, 0), index(b, 1), index(b, 2)]).collect();
        match all.iter().flatten().find(|i| u64::from(**i) >= vertices) {
            Some(i) => Err(format!("refers to vertex {i} of {vertices}")),
            None => Ok(all),
        }
    }
}

fn check(mesh: &mut RawMesh) -> Result<(), String> {
    if mesh.triangles.is_empty() {
        return Err("has no faces".into());
    }
    let finite = |v: &[f32]| v.iter().all(|c| c.is_finite());
    if let Some(at) = mesh.positions.iter().position(|p| !finite(p)) {
        return Err(format!("has a position that is not finite: vertex {at}"));
    }
    if !mesh.uvs.iter().all(|uv| finite(uv)) {
        mesh.uvs.clear();
        mesh.notes.push("texture coordinates are not finite: none are used".into());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use flate2::Compression;
    use flate2::write::ZlibEncoder;

    use super::*;

    /// A triangle as one mesh of a file.
    fn mesh(version: u16, double: bool, size: f64) -> Vec<u8> {
        let mut body = Vec::new();
        let flags = HAS_NORMALS | HAS_UVS | HAS_COLOURS | if double { DOUBLE } else { 0x1000 };
        body.extend((flags | FACE_NORMALS).to_le_bytes());
        if version == 4 {
            body.extend(b"a name\0");
        }
        body.extend(3u64.to_le_bytes());
        body.extend(1u64.to_le_bytes());
        let positions = [0.0, 0.0, 0.0, size, 0.0, 0.0, 0.0, size, 0.0];
        let normals = [0.0, 0.0, 1.0].repeat(3);
        let uvs = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0];
        for v in positions.iter().chain(&normals).chain(&uvs).chain(&[0.5; 9]) {
            if double {
                body.extend(v.to_le_bytes());
            } else {
                body.extend((*v as f32).to_le_bytes());
            }
        }
        (0..3u32).for_each(|i| body.extend(i.to_le_bytes()));
        let mut packed = ZlibEncoder::new(Vec::new(), Compression::default());
        packed.write_all(&body).unwrap();
        let mut out = 0x041c_u16.to_le_bytes().to_vec();
        out.extend(version.to_le_bytes());
        out.extend(packed.finish().unwrap());
        out
    }

    fn file(version: u16, double: bool) -> Vec<u8> {
        let mut out = mesh(version, double, 1.0);
        let second = out.len();
        out.extend(mesh(version, double, 2.0));
        for at in [0, second] {
            match version {
                3 => out.extend((at as u32).to_le_bytes()),
                _ => out.extend((at as u64).to_le_bytes()),
            }
        }
        out.extend(2u32.to_le_bytes());
        out
    }

    #[test]
    fn both_versions_and_precisions_hold_the_same_meshes() {
        for version in [3, 4] {
            for double in [false, true] {
                let bytes = file(version, double);
                for (index, size) in [(0, 1.0), (1, 2.0)] {
                    let mesh = read_serialized(&bytes, index).unwrap();
                    assert!(mesh.face_normals);
                    assert_eq!(mesh.positions, [[0.0; 3], [size, 0.0, 0.0], [0.0, size, 0.0]]);
                    assert_eq!(mesh.normals, [[0.0, 0.0, 1.0]; 3]);
                    assert_eq!(mesh.uvs[1], [1.0, 0.0]);
                    assert_eq!(mesh.triangles, [[0, 1, 2]]);
                }
            }
        }
        // A single mesh needs no list of offsets.
        assert!(read_serialized(&mesh(4, false, 1.0), 0).is_ok());
    }

    #[test]
    fn broken_files_are_refused_with_the_reason() {
        let whole = file(4, false);
        let mut version = whole.clone();
        version[2] = 7;
        let mut far = whole.clone();
        let entry = far.len() - 12;
        far[entry..entry + 8].copy_from_slice(&u64::MAX.to_le_bytes());
        for (bytes, index, reason) in [
            (b"".as_slice(), 0, "is shorter than the head of a mesh"),
            (b"PK\x03\x04", 0, "begins with 0x4b50 instead of 0x041c: it is no serialized mesh"),
            (&version, 0, "has version 7; known are 3 and 4"),
            (&whole, 2, "has 2 meshes: there is no shape_index 2"),
            (&far, 1, "has an offset of mesh 1 beyond its end"),
            (&whole[..30], 0, "cannot be unpacked: incomplete deflate stream"),
        ] {
            assert_eq!(read_serialized(bytes, index).unwrap_err(), reason);
        }
        let mut broken = whole;
        broken[4] = 0;
        assert!(read_serialized(&broken, 0).unwrap_err().starts_with("cannot be unpacked: "));
    }
}
