//! Planes of numbers and filters that go along their rows and then along their columns.

use rayon::prelude::*;

/// One number a pixel, row by row.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Plane {
    pub width: usize,
    pub values: Vec<f32>,
}

/// The weights of a filter along one line; the middle one belongs to the pixel itself.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Kernel(Vec<f32>);

impl Kernel {
    /// From −`radius` to `radius`, without the ends that weigh nothing.
    pub fn new(radius: usize, weight: impl Fn(f64) -> f64) -> Self {
        /// Of the largest weight: less is lost in the rounding of what is summed.
        const NOTHING: f64 = 1e-9;
        let at = |step: usize| [weight(-(step as f64)), weight(step as f64)];
        let most = (0..=radius).flat_map(at).fold(0.0, |most: f64, w| most.max(w.abs()));
        let matters = |step: &usize| at(*step).into_iter().any(|w| w.abs() > NOTHING * most);
        let radius = (0..=radius).rev().find(matters).unwrap_or(0) as i64;
        Self((-radius..=radius).map(|step| weight(step as f64) as f32).collect())
    }

    fn radius(&self) -> usize {
        self.0.len() / 2
    }
}

impl Plane {
    pub fn height(&self) -> usize {
        self.values.len().checked_div(self.width).unwrap_or(0)
    }

    /// Each pixel's value from that of this plane.
    pub fn map(&self, value: impl Fn(f32) -> f32 + Sync) -> Self {
        let values = self.values.par_iter().map(|&v| value(v)).collect();
        Self { width: self.width, values }
    }

    /// Each pixel's value from those of two planes.
    pub fn zip(&self, other: &Self, value: impl Fn(f32, f32) -> f32 + Sync) -> Self {
        let pairs = self.values.par_iter().zip(&other.values);
        Self { width: self.width, values: pairs.map(|(&a, &b)| value(a, b)).collect() }
    }

    /// Filtered along rows by one kernel and along columns by another. Beyond its border the
    /// plane goes on as it is there.
    pub fn filtered(&self, across: &Kernel, down: &Kernel) -> Self {
        self.across(across).down(down)
    }

    /// Filtered along rows.
    pub fn across(&self, kernel: &Kernel) -> Self {
        if self.values.is_empty() {
            return self.clone();
        }
        let (width, radius) = (self.width, kernel.radius());
        let mut values = vec![0f32; self.values.len()];
        let rows = values.par_chunks_mut(width).zip(self.values.par_chunks(width));
        rows.for_each_init(
            || vec![0f32; width + 2 * radius],
            |wide, (out, row)| {
                wide[..radius].fill(row[0]);
                wide[radius..radius + width].copy_from_slice(row);
                wide[radius + width..].fill(row[width - 1]);
                for (step, &weight) in kernel.0.iter().enumerate() {
                    add(out, &wide[step..step + width], weight);
                }
            },
        );
        Self { width, values }
    }

    /// Filtered along columns.
    pub fn down(&self, kernel: &Kernel) -> Self {
        if self.values.is_empty() {
            return self.clone();
        }
        let (width, radius) = (self.width, kernel.radius());
        let last = self.height() - 1;
        let mut values = vec![0f32; self.values.len()];
        values.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
            for (step, &weight) in kernel.0.iter().enumerate() {
                let from = (y + step).saturating_sub(radius).min(last) * width;
                add(out, &self.values[from..from + width], weight);
            }
        });
        Self { width, values }
    }
}

fn add(out: &mut [f32], row: &[f32], weight: f32) {
    out.iter_mut().zip(row).for_each(|(out, value)| *out += weight * value);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filters_are_those_of_the_sum_over_both_axes() {
        let (width, height) = (13, 9);
        let values = (0..width * height).map(|i| ((i * 37) % 101) as f32).collect();
        let plane = Plane { width, values };
        let (across, down) = (|x: f64| 1.0 + 0.3 * x, |y: f64| 0.5 - 0.1 * y * y);
        let found = plane.filtered(&Kernel::new(2, across), &Kernel::new(3, down));
        for y in 0..height as i64 {
            for x in 0..width as i64 {
                let mut sum = 0.0;
                for j in -3i64..=3 {
                    for i in -2i64..=2 {
                        let at =
                            |v: i64, step: i64, most: usize| (v + step).clamp(0, most as i64 - 1);
                        let place = at(y, j, height) * width as i64 + at(x, i, width);
                        let weight = across(i as f64) * down(j as f64);
                        sum += weight * f64::from(plane.values[place as usize]);
                    }
                }
                let found = f64::from(found.values[(y * width as i64 + x) as usize]);
                assert!((found - sum).abs() < 1e-3, "{x} {y}: {found} {sum}");
            }
        }
    }

    #[test]
    fn ends_that_weigh_nothing_are_left_out() {
        let bell = |x: f64| (-x * x).exp();
        let kernel = Kernel::new(50, bell);
        assert!(kernel.radius() < 6 && kernel.0.len() % 2 == 1);
        assert_eq!(kernel.0[kernel.radius()], 1.0);
        assert_eq!(Kernel::new(3, |_| 0.0).0, [0.0]);
    }

    #[test]
    fn planes_of_one_pixel_and_of_none_are_filtered_too() {
        let kernel = Kernel::new(4, |_| 1.0 / 9.0);
        let one = Plane { width: 1, values: vec![3.0] }.filtered(&kernel, &kernel);
        assert!((one.values[0] - 3.0).abs() < 1e-6);
        let none = Plane { width: 0, values: vec![] };
        assert_eq!(none.filtered(&kernel, &kernel), none);
    }
}
