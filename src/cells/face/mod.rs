//! A textured depth mesh: surfaces of pictures with depths.

mod capture;
mod depths;
mod parallax_mesh;
mod parallax_simplify;
mod patches;
mod raster;
mod rounded;
mod uncovered;

pub(super) use capture::{Capture, DIRECTIONS};
use depths::Depths;
use glam::{DQuat, DVec3, Vec3};
use image::RgbaImage;
pub(super) use parallax_mesh::BEHIND_PX;
use parallax_mesh::ParallaxMesh;
use parallax_simplify::simplified;
use patches::patches;
use rounded::rounded;

use super::options::CellOptions;
use crate::Result;
use crate::format::cells::FaceView;
use crate::format::{NodeImage, NodeImageData, NodeMesh, Primitive, Surface};
use crate::mesh::{AlphaMode, Wrap};
use crate::texture::{FacePicture, face_picture};

/// Neighbours are of one surface where the parallax of one is so near to what the surface of the other goes
/// on to, pixels.
const APART_PX: f32 = 0.5;

/// A picture of what is outside of a cull box, in one of six directions.
pub(in crate::cells) struct Captured {
    /// Alpha is 0 where nothing is.
    pub picture: RgbaImage,
    /// Metres along the view, row by row; infinite where nothing is.
    pub metres: Vec<f32>,
    /// Where the camera stood.
    pub eye: DVec3,
    pub rotation: DQuat,
}

/// A surface of a picture.
pub(super) struct Layer {
    /// Metres from the cell's origin.
    pub positions: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
    texcoords: Vec<[f32; 2]>,
    image: NodeImage,
    view: FaceView,
    error: f64,
}

impl Captured {
    /// The surface of what is seen, around an origin, with a picture; none where nothing is. The eye moves
    /// by so many metres from where the camera stood.
    pub fn layer(
        &self,
        origin: DVec3,
        reach_m: f64,
        options: &CellOptions,
    ) -> Result<Option<Layer>> {
        let depths = self.depths(reach_m, options);
        let whole = ParallaxMesh::new(&depths, APART_PX);
        let found = simplified(&whole, &depths, options.error_px as f32)?;
        let points = &found.mesh.points;
        if points.is_empty() {
            return Ok(None);
        }
        let (patches, of_points) = patches(&found.mesh, self.picture.dimensions().into());
        let FacePicture { bytes, size, shifts } =
            face_picture(&self.picture, &patches, options.jpeg_quality)?;
        let positions = points.iter().map(|&at| self.position(at, &depths, origin, options));
        let texcoord = |(at, &patch): (&[f32; 3], &u32)| {
            let shift = shifts[patch as usize];
            [0, 1].map(|axis| rounded((at[axis] + shift[axis]) / size[axis] as f32))
        };
        let forward = self.rotation * DVec3::NEG_Z;
        let to_camera = forward.dot(self.eye - origin);
        Ok(Some(Layer {
            positions: positions.collect(),
            triangles: found.mesh.triangles.clone(),
            texcoords: points.iter().zip(&of_points).map(texcoord).collect(),
            image: NodeImage {
                width: size[0],
                height: size[1],
                data: NodeImageData::Embedded { mime: "image/jpeg", bytes, file_name: None },
            },
            view: FaceView {
                size,
                solid_angle: self.solid_angle(options),
                projection: forward.extend(-to_camera).as_vec4().to_array(),
            },
            error: f64::from(found.most_error) / options.focal_px(),
        }))
    }

    /// Its depths, where the eye moves by so many metres.
    pub fn depths(&self, reach_m: f64, options: &CellOptions) -> Depths<'_> {
        Depths {
            metres: &self.metres,
            width: self.picture.width() as usize,
            pixel_metres: (options.focal_px() * reach_m) as f32,
        }
    }

    /// Metres from an origin of a point of a surface.
    fn position(
        &self,
        [x, y, parallax]: [f32; 3],
        depths: &Depths<'_>,
        origin: DVec3,
        options: &CellOptions,
    ) -> Vec3 {
        let metres = f64::from(depths.metres_of(parallax));
        let middle = f64::from(self.picture.width()) / 2.0;
        let [right, down] = [x, y].map(|at| (f64::from(at) - middle) / options.focal_px());
        let from_eye = self.rotation * (DVec3::new(right, -down, -1.0) * metres);
        (from_eye + (self.eye - origin)).as_vec3().map(rounded)
    }

    /// Steradians in which something is.
    fn solid_angle(&self, options: &CellOptions) -> f32 {
        let (side, focal_px) = (self.picture.width() as usize, options.focal_px());
        let mut sum = 0.0;
        for (at, metres) in self.metres.iter().enumerate() {
            if metres.is_finite() {
                let [x, y] = [at % side, at / side]
                    .map(|at| (at as f64 + 0.5 - side as f64 / 2.0) / focal_px);
                let squared = 1.0 + x * x + y * y;
                sum += 1.0 / (squared * squared.sqrt() * focal_px * focal_px);
            }
        }
        sum as f32
    }
}

/// A face, before it has a file.
pub(super) struct Made {
    pub mesh: NodeMesh,
    pub bounds: [[f64; 3]; 2],
    pub error: f64,
    pub views: Vec<FaceView>,
}

impl Made {
    /// Puts layers around an origin together; none where there are none. The origin fits in f32.
    pub fn of(layers: Vec<Layer>, origin: DVec3) -> Option<Self> {
        let bounds = bounds(&layers, origin)?;
        let error = layers.iter().fold(0.0, |most: f64, layer| most.max(layer.error));
        let mut made = Self {
            mesh: NodeMesh {
                origin: origin.to_array(),
                images: Vec::new(),
                primitives: Vec::new(),
            },
            bounds,
            error,
            views: Vec::new(),
        };
        for layer in layers {
            made.mesh.primitives.push(Primitive {
                positions: layer.positions.iter().map(Vec3::to_array).collect(),
                texcoords: layer.texcoords,
                colors: Vec::new(),
                indices: layer.triangles.into_flattened(),
                normals: Vec::new(),
                skirt_triangles: 0,
                surface: Surface {
                    base_color: [1.0; 4],
                    image: Some(made.mesh.images.len()),
                    wrap: [Wrap::Clamp; 2],
                    alpha: AlphaMode::Opaque,
                    double_sided: true,
                    is_unlit: false,
                },
            });
            made.mesh.images.push(layer.image);
            made.views.push(layer.view);
        }
        Some(made)
    }
}

fn bounds(layers: &[Layer], origin: DVec3) -> Option<[[f64; 3]; 2]> {
    let mut positions = layers.iter().flat_map(|layer| &layer.positions).copied();
    let first = positions.next()?;
    let bounds = positions.fold([first; 2], |[min, max], at| [min.min(at), max.max(at)]);
    Some(bounds.map(|at| (at.as_dvec3() + origin).to_array()))
}
