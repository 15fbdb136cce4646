//! LDR-FLIP (Andersson et al. 2020): what an observer sees of a difference when flipping between
//! two images. No figure of error.

use crate::output::tone_map;

/// Mean LDR-FLIP of two images at one exposure, tone-mapped as the PNG files are, at 67 pixels per
/// degree; in [0, 1].
///
/// `None` where the crate was built without the feature `flip`, or where the images have not
/// `width` × `height` pixels.
pub fn flip(
    reference: &[f32],
    image: &[f32],
    width: u32,
    height: u32,
    exposure: f64,
) -> Option<f64> {
    let values = width as usize * height as usize * 3;
    if values == 0 || reference.len() != values || image.len() != values {
        return None;
    }
    let bytes = |image: &[f32]| -> Vec<u8> {
        let (pixels, _) = image.as_chunks::<3>();
        pixels.iter().flat_map(|p| tone_map(p.map(f64::from), exposure)).collect()
    };
    mean_flip(&bytes(reference), &bytes(image), width, height)
}

/// True where this build can measure FLIP.
pub const fn flip_is_built_in() -> bool {
    cfg!(feature = "flip")
}

#[cfg(feature = "flip")]
fn mean_flip(reference: &[u8], image: &[u8], width: u32, height: u32) -> Option<f64> {
    use nv_flip::{DEFAULT_PIXELS_PER_DEGREE, FlipImageRgb8, flip};
    let of = |bytes: &[u8]| FlipImageRgb8::with_data(width, height, bytes);
    let map = flip(of(reference), of(image), DEFAULT_PIXELS_PER_DEGREE).to_vec();
    Some(map.iter().map(|v| f64::from(*v)).sum::<f64>() / map.len() as f64)
}

#[cfg(not(feature = "flip"))]
fn mean_flip(_: &[u8], _: &[u8], _: u32, _: u32) -> Option<f64> {
    None
}

#[cfg(all(test, feature = "flip"))]
mod tests {
    use super::*;

    #[test]
    fn equal_images_are_0_and_black_against_white_is_1() {
        let (black, white) = (vec![0.0; 32 * 32 * 3], vec![100.0; 32 * 32 * 3]);
        assert_eq!(flip(&white, &white, 32, 32, 1.0), Some(0.0));
        let most = flip(&black, &white, 32, 32, 1.0).unwrap();
        assert!(most > 0.95 && most <= 1.0, "{most}");
    }

    #[test]
    fn more_noise_is_more_to_see() {
        let grey = vec![0.3; 32 * 32 * 3];
        let noisy = |amplitude: f32| -> Vec<f32> {
            let step = |i: usize| if (i / 3) * 7919 % 13 < 6 { amplitude } else { -amplitude };
            (0..grey.len()).map(|i| 0.3 + step(i)).collect()
        };
        let seen = |amplitude| flip(&grey, &noisy(amplitude), 32, 32, 1.0).unwrap();
        assert!(0.0 < seen(0.05) && seen(0.05) < seen(0.2));
    }

    #[test]
    fn images_of_another_size_are_none() {
        assert_eq!(flip(&[0.0; 3], &[0.0; 6], 1, 1, 1.0), None);
        assert_eq!(flip(&[], &[], 0, 0, 1.0), None);
    }
}
