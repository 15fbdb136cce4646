//! Valid files with random bytes changed: reading may fail, but it never panics.

use pathspace_scenes::load_str;
use pathspace_scenes::source::Memory;

const XML: &str = r##"<?xml version="1.0"?>
<scene version="0.6.0">
  <default name="n" value="8"/>
  <integrator type="path"><integer name="maxDepth" value="$n"/></integrator>
  <sensor type="thinlens">
    <float name="fov" value="40"/> <string name="fovAxis" value="smaller"/>
    <float name="apertureRadius" value="0.1"/> <float name="focusDistance" value="3"/>
    <transform name="toWorld"><lookAt origin="1, 2, 3" target="0, 0, 0" up="0, 1, 0"/></transform>
    <film type="ldrfilm"><integer name="width" value="64"/><rfilter type="gaussian"/></film>
  </sensor>
  <bsdf type="twosided" id="a"><bsdf type="roughconductor"><float name="alpha" value="0.1"/>
    <rgb name="eta" value="1, 2, 3"/></bsdf></bsdf>
  <bsdf type="dielectric" id="b"><string name="intIOR" value="water"/></bsdf>
  <shape type="obj"><string name="filename" value="m.obj"/><ref id="a"/>
    <transform name="toWorld"><rotate y="1" angle="30"/><scale x="-2"/>
    <matrix value="1 0 0 1 0 1 0 2 0 0 1 3 0 0 0 1"/></transform></shape>
  <shape type="ply"><string name="filename" value="m.ply"/><ref id="b"/></shape>
  <shape type="sphere"><point name="center" x="1" y="2" z="3"/><float name="radius" value="2"/>
    <emitter type="area"><srgb name="radiance" value="#ff8800"/></emitter></shape>
  <emitter type="point"><point name="position" value="1 2 3"/></emitter>
  <include filename="more.xml"/>
</scene>
"##;

const MORE: &str = r#"<scene version="3.0.0"><shape type="disk"><boolean name="flip_normals" value="true"/></shape></scene>"#;

const OBJ: &str = "# a\nv -1 -1 0\nv 1 -1 0\nv 1 1 0 1\nv -1 1 0.5\nvn 0.3 0 1\nvt 0 0\nvt 1 1\no part\n\
                   f 1/1/1 2/2/1 3/1/1\nusemtl x\nf -4/1/-1 -2/2/1 4/-1/1\nf 1//1 2//1 3//1 4//1\n";

fn ply(encoding: &str) -> Vec<u8> {
    let head = format!(
        "ply\nformat {encoding} 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
         property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    );
    let mut out = head.into_bytes();
    if encoding == "ascii" {
        out.extend(b"0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
    } else {
        for value in [0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0] {
            out.extend(value.to_le_bytes());
        }
        out.push(3);
        for index in 0..3i32 {
            out.extend(index.to_le_bytes());
        }
    }
    out
}

/// Marsaglia's xorshift: the test must do the same everywhere.
struct Xorshift(u64);

impl Xorshift {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % n as u64) as usize
    }
}

/// Bytes that mean something in these formats, beside arbitrary ones.
const INTERESTING: &[u8] = b"0123456789-+.eE/\"<>$&#\n \x00\xff";

fn mutate(bytes: &[u8], random: &mut Xorshift) -> Vec<u8> {
    let mut out = bytes.to_vec();
    for _ in 0..=random.below(3) {
        if out.is_empty() {
            break;
        }
        let at = random.below(out.len());
        let byte = match random.below(4) {
            0 => random.below(256) as u8,
            _ => INTERESTING[random.below(INTERESTING.len())],
        };
        match random.below(5) {
            0 => out.insert(at, byte),
            1 => drop(out.remove(at)),
            2 => {
                // Repeat a part, so that numbers grow and elements double.
                let end = (at + 1 + random.below(12)).min(out.len());
                let part = out[at..end].to_vec();
                out.splice(at..at, part);
            }
            3 if random.below(20) == 0 => out.truncate(at.max(1)),
            _ => out[at] = byte,
        }
    }
    out
}

/// Reads the scene with one of its files changed; true where it is still fine.
fn reads(which: usize, random: &mut Xorshift) -> bool {
    let mut parts = [XML.as_bytes().to_vec(), OBJ.into(), ply("ascii"), MORE.into()];
    if random.below(2) == 0 {
        parts[2] = ply("binary_little_endian");
    }
    parts[which] = mutate(&parts[which], random);
    let [xml, obj, ply, more] = parts;
    let files = Memory::new().with("m.obj", obj).with("m.ply", ply).with("more.xml", more);
    match load_str(&String::from_utf8_lossy(&xml), "t.xml", &files, &[]) {
        Ok(_) => true,
        Err(e) => {
            let line = e.to_string();
            assert!(!line.contains('\n') && line.len() < 2000, "{line}");
            false
        }
    }
}

#[test]
fn changed_bytes_never_panic() {
    let mut random = Xorshift(0x9e37_79b9_7f4a_7c15);
    for (which, name) in ["XML", "OBJ", "PLY", "included XML"].iter().enumerate() {
        let rounds = 5000;
        let fine = (0..rounds).filter(|_| reads(which, &mut random)).count();
        // Some changes do no harm and many do: otherwise the test tests nothing.
        assert!(fine > 0 && fine < rounds, "{name}: {fine} of {rounds} are fine");
    }
}

#[test]
fn the_unchanged_scene_is_fine() {
    for encoding in ["ascii", "binary_little_endian"] {
        let files = Memory::new()
            .with("m.obj", OBJ.as_bytes())
            .with("m.ply", ply(encoding))
            .with("more.xml", MORE.as_bytes());
        load_str(XML, "t.xml", &files, &[]).unwrap_or_else(|e| panic!("{e}"));
    }
}
