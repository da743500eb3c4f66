//! The number of texels that triangles of the original deserve in a square metre at full detail.

use super::source::{ImageKind, SourceTriangle};

/// Triangles of the original whose image repeats get so many texels on average. Images with
/// more take more bytes than levels whose textures are shared.
const REPEATING_TEXELS: f64 = 64.0;

/// Gives triangles, whose density is that of their images, the density that they deserve. Returns the texels of
/// those together whose image repeats.
pub(super) fn settle(triangles: &mut [SourceTriangle]) -> f64 {
    limit_density(triangles);
    let is_repeating = |triangle: &&mut SourceTriangle| triangle.image == ImageKind::Repeating;
    let mut repeating: Vec<&mut SourceTriangle> =
        triangles.iter_mut().filter(is_repeating).collect();
    let most_texels = REPEATING_TEXELS * repeating.len() as f64;
    let texels = limit_together(&mut repeating, most_texels);
    // An edge between plain colours is as sharp as what has an image.
    let with_image = triangles.iter().filter(|triangle| triangle.image != ImageKind::Plain);
    let (all, area) = with_image.fold((0.0, 0.0), |(texels, area), triangle| {
        (texels + triangle.area * triangle.density, area + triangle.area)
    });
    let mean = if area > 0.0 { all / area } else { 0.0 };
    let plain = triangles.iter_mut().filter(|triangle| triangle.image == ImageKind::Plain);
    plain.for_each(|triangle| triangle.density = mean);
    texels
}

/// Gives triangles the largest common limit of their densities with which they have no more than so many texels
/// together. Returns these texels.
fn limit_together(triangles: &mut [&mut SourceTriangle], most_texels: f64) -> f64 {
    triangles.sort_by(|a, b| a.density.total_cmp(&b.density));
    let mut area_left: f64 = triangles.iter().map(|triangle| triangle.area).sum();
    let mut texels = 0.0;
    for index in 0..triangles.len() {
        let SourceTriangle { density, area, .. } = *triangles[index];
        if texels + density * area_left > most_texels {
            let limit = (most_texels - texels) / area_left;
            triangles[index..].iter_mut().for_each(|triangle| triangle.density = limit);
            return most_texels;
        }
        texels += density * area;
        area_left -= area;
    }
    texels
}

/// A triangle has at most so many times the density of all together. One that has more lost its
/// area, as rounding to a lattice makes it, and says nothing of how sharp the original is.
const MOST_DENSITY: f64 = 1e4;

/// Gives triangles that all but lost their area the density of all together.
fn limit_density(triangles: &mut [SourceTriangle]) {
    let texels: f64 = triangles.iter().map(SourceTriangle::texel_area).sum();
    let sound = triangles.iter().filter(|triangle| triangle.density.is_finite());
    let metres: f64 = sound
        .filter(|triangle| triangle.density > 0.0)
        .map(|triangle| triangle.texel_area() / triangle.density)
        .sum();
    let mean = if metres > 0.0 { texels / metres } else { 0.0 };
    for triangle in triangles {
        if !triangle.density.is_finite() || triangle.density > mean * MOST_DENSITY {
            triangle.density = mean;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    /// A triangle of half a texel.
    fn triangle(density: f64) -> SourceTriangle {
        SourceTriangle {
            normal: DVec3::Z,
            area: 0.5 / density,
            material: 0,
            is_lit: false,
            image: ImageKind::CutUp,
            chart: 0,
            texels: [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
            colors: None,
            density,
        }
    }

    #[test]
    fn dense_images_that_repeat_are_limited_to_what_there_is_for_all() {
        let limited = |most_texels: f64| {
            let all = [(9.0, 2.0), (1.0, 4.0), (100.0, 1.0)];
            let mut all = all.map(|(density, area)| SourceTriangle { area, ..triangle(density) });
            let texels = limit_together(&mut all.iter_mut().collect::<Vec<_>>(), most_texels);
            let sum: f64 = all.iter().map(|triangle| triangle.density * triangle.area).sum();
            assert!((texels - sum).abs() < 1e-9, "{texels} {sum}");
            all.map(|triangle| triangle.density)
        };
        assert_eq!(limited(122.0), [9.0, 1.0, 100.0], "4 + 18 + 100 texels");
        assert_eq!(limited(62.0), [9.0, 1.0, 40.0]);
        assert_eq!(limited(16.0), [4.0, 1.0, 4.0]);
        assert_eq!(limited(3.5), [0.5; 3]);
    }

    #[test]
    fn what_is_plain_is_as_dense_as_the_rest_together() {
        let of = |image: ImageKind, area: f64| SourceTriangle { image, area, ..triangle(8.0) };
        let mut all =
            [of(ImageKind::CutUp, 3.0), of(ImageKind::Repeating, 24.0), of(ImageKind::Plain, 9.0)];
        assert_eq!(settle(&mut all), REPEATING_TEXELS);
        let limit = REPEATING_TEXELS / 24.0;
        let mean = (3.0 * 8.0 + REPEATING_TEXELS) / 27.0;
        assert_eq!(all.map(|triangle| triangle.density), [8.0, limit, mean]);
    }

    #[test]
    fn triangles_without_area_have_the_density_of_all_together() {
        let limited = |densities: &[f64]| {
            let mut triangles: Vec<_> = densities.iter().map(|&at| triangle(at)).collect();
            limit_density(&mut triangles);
            triangles.into_iter().map(|triangle| triangle.density).collect::<Vec<f64>>()
        };
        assert_eq!(limited(&[100.0, 400.0, 0.0]), [100.0, 400.0, 0.0], "all sound");
        let mean = |count: f64| count / (2.0 / 100.0);
        for lost in [f64::INFINITY, f64::NAN, 1e300, 0.5 / f64::MIN_POSITIVE] {
            let found = limited(&[100.0, 100.0, lost]);
            assert_eq!(found[..2], [100.0; 2]);
            assert!((found[2] - mean(3.0)).abs() < 1e-9, "{found:?}");
        }
        assert_eq!(limited(&[f64::INFINITY]), [0.0], "nothing is known");
    }
}
