//! Generated cities for tests and benchmarks, of the character of scanned ones.
//!
//! The models that Lakhia describes (2004, sections 1.1 and 3.2) come from a laser scanner driven
//! through the streets: each block is one side of a city block, a row of façades sampled every
//! 10 cm or so, noisy and dense even where the wall is flat, with holes where cars and trees stood
//! before it and one large texture that repeats nothing. Roofs and ground are coarser and have no
//! texture. A generated city has all of that at any size, and a texture drawn so that misplaced
//! texels show: see [`TileCode`].
//!
//! Axes: x east, y north, z up; metres. All coordinates are whole multiples of 0.1 mm, so that
//! four decimals of text hold them exactly.

mod block;
mod facade;
mod fixed;
mod glb;
mod grid;
mod holes;
mod layout;
mod obj;
mod options;
mod sampling;
mod scan;
mod shell;
mod staging;
mod stream;
mod summary;
mod tears;
mod texture;
mod tiles;

use std::path::Path;

use image::RgbImage;

use crate::{Error, Result};
use facade::Facade;
use layout::BlockPlacement;
use sampling::Sampling;
use scan::{STEPS_PER_METRE, Scan};
use tears::Tears;

pub use block::CityBlock;
pub use options::{CityOptions, TextureSize};
pub use summary::CitySummary;
pub use tiles::{TileCode, TileGrid, TileSample};

/// Generates a city and writes it.
///
/// `out` ends in `.obj` or `.glb`; with [`CityOptions::split`] it is a folder instead. Missing
/// parent folders are created. An OBJ comes with an `.mtl` beside it and its textures in a folder
/// `<name>_textures`. All is written beside its target and renamed at the end; an earlier city
/// there is replaced, a folder that holds anything else is refused. Work runs on the current rayon
/// pool; the bytes do not depend on the number of threads.
pub fn write(options: &CityOptions, out: &Path) -> Result<CitySummary> {
    let city = City::new(options)?;
    let extension = out.extension().unwrap_or_default().to_ascii_lowercase();
    match (options.split, extension.to_str()) {
        (true, Some("obj" | "glb")) => Err(Error::Usage(format!(
            "{}: --split writes a folder, so the output must not end in .obj or .glb",
            out.display()
        ))),
        (true, _) => obj::write_split(&city, out),
        (false, Some("obj")) => obj::write_single(&city, out),
        (false, Some("glb")) => glb::write(&city, out),
        _ => Err(Error::Usage(format!(
            "{}: expected an output that ends in .obj or .glb",
            out.display()
        ))),
    }
}

/// One block of a city, without files. [`City::block`] is faster for many blocks of one city.
pub fn block(options: &CityOptions, index: usize) -> Result<CityBlock> {
    let city = City::new(options)?;
    city.block(index).ok_or_else(|| {
        Error::Usage(format!("block {index}: the city has blocks 0 to {}", city.len() - 1))
    })
}

/// A city laid out: what each block will be, before any is sampled.
#[derive(Clone, Debug)]
pub struct City {
    options: CityOptions,
    plans: Vec<Plan>,
}

/// What one block will be.
#[derive(Clone, Debug)]
struct Plan {
    placement: BlockPlacement,
    facade: Facade,
    triangles: u64,
    seed: u64,
}

impl City {
    /// Lays out a city; refuses options that are out of range.
    pub fn new(options: &CityOptions) -> Result<Self> {
        options.validate()?;
        let mut plans: Vec<Plan> = layout::placements(options.seed, options.blocks)
            .into_iter()
            .zip(0..)
            .map(|(placement, index)| {
                let seed = crate::random::hash(options.seed, index, 0xb10c);
                let facade = Facade::draw(seed, placement.length);
                Plan { placement, facade, triangles: 0, seed }
            })
            .collect();
        // Triangles go by façade area, so that the sample spacing is the same everywhere. The
        // shares are differences of rounded sums, so that they add up to the total.
        let total_area: f64 = plans.iter().map(|plan| plan.facade.area()).sum();
        let (mut area, mut given) = (0.0, 0);
        for plan in &mut plans {
            area += plan.facade.area();
            let upto = (options.triangles as f64 * (area / total_area)).round() as u64;
            plan.triangles = upto - given;
            given = upto;
        }
        Ok(Self { options: options.clone(), plans })
    }

    /// The number of blocks.
    pub fn len(&self) -> usize {
        self.plans.len()
    }

    /// Never true: a city has at least one block.
    pub fn is_empty(&self) -> bool {
        self.plans.is_empty()
    }

    /// The group name of a block in the files.
    pub fn block_name(&self, index: usize) -> String {
        format!("block_{index:04}")
    }

    /// Samples a block; `None` past the last.
    pub fn block(&self, index: usize) -> Option<CityBlock> {
        self.plans.get(index).map(|plan| {
            let scan = self.scan(plan);
            CityBlock::new(self.block_name(index), self.origin(plan), scan, self.is_textured())
        })
    }

    /// Draws a block's texture; `None` past the last block or where the city has no textures.
    pub fn texture(&self, index: usize) -> Option<RgbImage> {
        let plan = self.plans.get(index)?;
        let grid = TileGrid::new(plan.texture_size(self.options.texture)?);
        let whole = texture::draw(&plan.facade, &grid, &TileCode::new(index));
        Some(match self.tears(plan) {
            Some(tears) => tears.tear_image(&whole),
            None => whole,
        })
    }

    /// The tiles of a block's texture; `None` past the last or where the city has no textures or
    /// torn ones.
    pub fn tiles(&self, index: usize) -> Option<TileGrid> {
        let plan = self.plans.get(index).filter(|_| self.options.charts == 1)?;
        plan.texture_size(self.options.texture).map(TileGrid::new)
    }

    /// The tile that a block's texture shows at a texture coordinate (v grows downwards) and how
    /// clear of edges the position is. `None` outside 0–1, past the last block, or without textures.
    /// The colour there is [`TileCode::new`]`(index).color(tile)`, within the code's tolerance.
    pub fn tile_at(&self, index: usize, texcoord: [f64; 2]) -> Option<TileSample> {
        self.tiles(index)?.at(texcoord)
    }

    fn is_textured(&self) -> bool {
        self.options.texture != TextureSize::None
    }

    /// The encoded texture of a block, where there is one.
    fn jpeg(&self, index: usize) -> Result<Option<Jpeg>> {
        self.texture(index).map(|image| encode(&image, self.options.jpeg_quality)).transpose()
    }

    fn sampling(&self, plan: &Plan) -> Sampling {
        let overhang = plan.placement.ground_overhang;
        Sampling::new(&plan.facade, overhang, self.options.watertight, plan.triangles)
    }

    /// How a block's texture is torn, where it is.
    fn tears(&self, plan: &Plan) -> Option<Tears> {
        let charts = Some(self.options.charts).filter(|&charts| charts > 1)?;
        let whole = plan.texture_size(self.options.texture)?;
        Some(Tears::new(&self.sampling(plan).grid, whole, charts, plan.seed))
    }

    /// A block's mesh, its steps counted from [`City::origin`].
    fn scan(&self, plan: &Plan) -> Scan {
        let mut scan = scan::scan(&plan.facade, &plan.placement, &self.sampling(plan), plan.seed);
        if let Some(tears) = self.tears(plan) {
            tears.tear_scan(&mut scan);
        }
        let rest = self.world_steps(plan).map(|steps| steps.rem_euclid(STEPS_PER_METRE as i64));
        if rest != [0; 3] {
            for position in &mut scan.positions {
                *position = std::array::from_fn(|axis| position[axis] + rest[axis] as i32);
            }
        }
        scan
    }

    /// Whole metres at or below the corner that the block is sampled from.
    fn origin(&self, plan: &Plan) -> [i64; 3] {
        self.world_steps(plan).map(|steps| steps.div_euclid(STEPS_PER_METRE as i64))
    }

    fn world_steps(&self, plan: &Plan) -> [i64; 3] {
        let [x, y] = plan.placement.corner;
        let offset = self.options.offset.map(|metres| (metres * STEPS_PER_METRE).round() as i64);
        std::array::from_fn(|axis| offset[axis] + [x, y, 0][axis] * STEPS_PER_METRE as i64)
    }
}

impl Plan {
    /// Texels across and down.
    fn texture_size(&self, size: TextureSize) -> Option<[u32; 2]> {
        match size {
            TextureSize::None => None,
            TextureSize::Fixed(width, height) => Some([width, height]),
            TextureSize::PerTriangle(texels) => {
                let area = texels * self.triangles as f64;
                let side = |texels: f64| {
                    let (least, most) = (options::MIN_TEXTURE_SIDE, options::MAX_TEXTURE_SIDE);
                    (texels.round() as u32).clamp(least, most)
                };
                // Where one side meets its limit the other takes what is left.
                let width = side((area * self.facade.length / self.facade.height).sqrt());
                Some([width, side(area / f64::from(width))])
            }
        }
    }
}

/// An encoded texture.
struct Jpeg {
    bytes: Vec<u8>,
    texels: u64,
}

fn encode(image: &RgbImage, quality: u8) -> Result<Jpeg> {
    let mut bytes = Vec::new();
    let (width, height) = image.dimensions();
    jpeg_encoder::Encoder::new(&mut bytes, quality)
        .encode(image.as_raw(), width as u16, height as u16, jpeg_encoder::ColorType::Rgb)
        .map_err(|error| Error::Internal(format!("JPEG of {width}x{height} texels: {error}")))?;
    Ok(Jpeg { bytes, texels: u64::from(width) * u64::from(height) })
}

#[cfg(test)]
mod tests;
