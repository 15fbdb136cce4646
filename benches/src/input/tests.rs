use std::fs;

use pathspace_core::description::{Crop, FilmDescription, FilterKind};

use super::*;
use crate::output::{Metadata, Output, Picture};

const PIXELS: [[f32; 3]; 2] = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.5]];

fn in_file(name: &str, bytes: &[u8]) -> Result<InputImage, InputError> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    fs::write(&path, bytes).unwrap();
    read(&path)
}

fn npy(header: &str, data: &[u8]) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(data);
    bytes
}

fn floats() -> Vec<u8> {
    PIXELS.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect()
}

#[test]
fn our_own_images_come_back_with_their_seconds() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.exr");
    let crop = Crop { x: 0, y: 0, width: 2, height: 1 };
    let film = FilmDescription { width: 2, height: 1, crop, filter: FilterKind::Box };
    let wide = PIXELS.map(|p| p.map(f64::from));
    let metadata = Metadata { seconds: 2.5, ..Metadata::default() };
    let picture = Picture { film, pixels: &wide, layers: &[], metadata };
    Output::open(&path).unwrap().write(&picture, 1.0).unwrap();
    let image = read(&path).unwrap();
    assert_eq!((image.width, image.height, image.seconds), (2, 1, Some(2.5)));
    assert_eq!(image.pixels, PIXELS);
}

#[test]
fn pfm_is_read_from_bottom_to_top() {
    let mut bytes = b"PF\n1 2\n-1.0\n".to_vec();
    bytes.extend(floats());
    let image = in_file("a.pfm", &bytes).unwrap();
    assert_eq!((image.width, image.height), (1, 2));
    assert_eq!(image.pixels, [PIXELS[1], PIXELS[0]]);
}

#[test]
fn npy_is_read_in_both_orders() {
    let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 2, 3), }\n";
    let image = in_file("a.npy", &npy(header, &floats())).unwrap();
    assert_eq!((image.width, image.height), (2, 1));
    assert_eq!(image.pixels, PIXELS);
    let columns: Vec<u8> =
        [1.0_f32, 4.0, 2.0, 5.0, 3.0, 6.5].iter().flat_map(|v| v.to_le_bytes()).collect();
    let image = in_file("a.npy", &npy(&header.replace("False", "True"), &columns)).unwrap();
    assert_eq!(image.pixels, PIXELS);
}

#[test]
fn grey_images_have_three_equal_channels() {
    let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }\n";
    let image = in_file("a.npy", &npy(header, &floats())).unwrap();
    assert_eq!(image.pixels[5], [6.5; 3]);
}

#[test]
fn what_is_no_image_is_named_with_the_fault() {
    let cases: [(&str, Vec<u8>, &str); 8] = [
        ("a.jpg", vec![], "known: .exr, .pfm, .npy"),
        ("a.exr", b"nothing".to_vec(), "is neither an OpenEXR nor a PFM file"),
        ("a.exr", b"\x76\x2f\x31\x01 and no more".to_vec(), "cannot be read as OpenEXR"),
        ("a.pfm", b"P6\n1 1\n255\n".to_vec(), "is neither an OpenEXR nor a PFM file"),
        ("a.pfm", b"PF\n1 1\n-1\nabc".to_vec(), "3 bytes of texels instead of 12"),
        ("a.npy", npy("{'descr': '<i4', 'shape': (1, 2, 3)}", &floats()), "type '<i4'"),
        ("a.npy", npy("{'descr': '<f4', 'shape': (6,)}", &floats()), "shape (6,)"),
        (
            "a.npy",
            npy("{'descr': '<f4', 'shape': (1, 1)}", &f32::NAN.to_le_bytes()),
            "pixel (0, 0) is [NaN",
        ),
    ];
    for (name, bytes, fault) in cases {
        let told = in_file(name, &bytes).unwrap_err().to_string();
        assert!(told.contains(name) && told.contains(fault), "{told}");
    }
}
