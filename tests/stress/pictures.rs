//! Pictures and texture coordinates of every kind, on the same hills.

use std::path::{Path, PathBuf};

use image::{DynamicImage, GrayImage, ImageBuffer, Rgb, RgbaImage};

use crate::chain::{Chain, options};
use crate::colors::mean_color;
use crate::figures::Figures;
use crate::shape::{Shape, paint, picture, picture_of};
use crate::support::inputs::write;
use crate::table::{Bounds, Table, Twin};

/// Hills with a picture of any format.
fn chain(shape: &Shape, save: impl Fn(&Path) -> PathBuf) -> Chain {
    let folder = crate::chain::inputs();
    let input = shape.write(&folder);
    let picture = save(&folder);
    let name = picture.file_name().unwrap().to_str().unwrap();
    write(&folder, "hard.mtl", format!("newmtl hard\nKd 1 1 1\nmap_Kd {name}\n"));
    Chain::new(&input, &options()).unwrap()
}

fn png(image: impl Into<DynamicImage>) -> impl Fn(&Path) -> PathBuf {
    let image = image.into();
    move |folder| {
        let path = folder.join("other.png");
        image.save(&path).unwrap();
        path
    }
}

fn figures(chain: &Chain) -> Figures {
    let mut figures = chain.own_figures();
    for (name, value) in ["mean red", "mean green", "mean blue"].into_iter().zip(mean_color(chain))
    {
        figures.add(name, value, 100.0);
    }
    figures
}

/// Hills with other texture coordinates.
fn mapped(map: impl Fn(usize, [f64; 2]) -> [f64; 2]) -> Shape {
    let mut shape = Shape::hills();
    let places = 0..shape.texcoords.len();
    shape.texcoords = places.zip(&shape.texcoords).map(|(n, &uv)| map(n, uv)).collect();
    shape
}

#[test]
fn pictures_of_every_kind() {
    let mut table = Table::new("8-pictures", "Textures and texture coordinates");
    let mut check = |name: &str, case: Chain, twin: &Twin, bounds: Bounds, why: &str| {
        table.verified(name, case.failures());
        table.within(name, &figures(&case), twin, bounds, why);
    };
    let hills = Shape::hills();
    // The same hills, moved by less than rounding.
    let several = |name: &str, image: image::RgbImage| {
        let figures = |shake| figures(&chain(&hills.clone().shaken(shake), png(image.clone())));
        Twin::several(name, (0..4).map(figures).collect())
    };
    let plain = several("256 × 256, RGB", picture(256, 256));
    let same: Bounds = &[];
    let one = |color| picture_of(64, 64, move |_, _| color);

    let orange = [200, 120, 40];
    let of_orange = several("64 × 64 of one colour", one(orange));
    let colors = "one colour is as JPEG rounds it";
    let colorless: Bounds =
        &[("colour RMS", f64::INFINITY), ("leaf colour", f64::INFINITY), ("mean", 0.04)];
    check(
        "1 × 1",
        chain(&hills, png(picture_of(1, 1, |_, _| orange))),
        &of_orange,
        colorless,
        colors,
    );

    let column = |_: f64, v: f64| paint(0.5, v);
    let bands = several("the same bands, 256 × 256", picture_of(256, 256, column));
    check(
        "1 × 16384",
        chain(&hills, png(picture_of(1, 16384, column))),
        &bands,
        colorless,
        "other texels",
    );
    let row = |u: f64, _: f64| paint(u, 0.5);
    let bands = several("the same bands, 256 × 256", picture_of(256, 256, row));
    check(
        "16384 × 1",
        chain(&hills, png(picture_of(16384, 1, row))),
        &bands,
        colorless,
        "other texels",
    );
    check("257 × 241", chain(&hills, png(picture(257, 241))), &plain, colorless, "other texels");
    let deep = ImageBuffer::<Rgb<u16>, _>::from_fn(256, 256, |x, y| {
        let pixel = paint((f64::from(x) + 0.5) / 256.0, (f64::from(y) + 0.5) / 256.0);
        Rgb(pixel.map(|channel| u16::from(channel) * 257))
    });
    check("16 bits a channel", chain(&hills, png(deep)), &plain, same, "");
    let grey = |u: f64, v: f64| paint(u, v)[0];
    let as_grey = |u: f64, v: f64| [grey(u, v); 3];
    let of_grey = several("the same as RGB", picture_of(256, 256, as_grey));
    let grey = GrayImage::from_fn(256, 256, |x, y| {
        image::Luma([grey((f64::from(x) + 0.5) / 256.0, (f64::from(y) + 0.5) / 256.0)])
    });
    check("grey", chain(&hills, png(grey)), &of_grey, same, "");

    let jpeg = |cmyk: bool| {
        move |folder: &Path| {
            let path = folder.join("other.jpg");
            let image = picture(256, 256);
            let encoder = jpeg_encoder::Encoder::new_file(&path, 100).unwrap();
            let (bytes, kind): (Vec<u8>, _) = match cmyk {
                true => (
                    image.pixels().flat_map(|p| [255 - p[0], 255 - p[1], 255 - p[2], 0]).collect(),
                    jpeg_encoder::ColorType::Cmyk,
                ),
                false => (image.into_raw(), jpeg_encoder::ColorType::Rgb),
            };
            encoder.encode(&bytes, 256, 256, kind).unwrap();
            path
        }
    };
    let all = (0..4).map(|shake| figures(&chain(&hills.clone().shaken(shake), jpeg(false))));
    let of_jpeg = Twin::several("RGB JPEG", all.collect());
    let lossy: Bounds = &[("leaf colour", 0.03), ("colour", 0.03)];
    let why = "four channels lose other bits";
    check("CMYK JPEG", chain(&hills, jpeg(true)), &of_jpeg, lossy, why);

    let with_alpha = |alpha: fn(u32, u32) -> u8| {
        let image = picture(256, 256);
        RgbaImage::from_fn(256, 256, |x, y| {
            let [r, g, b] = image.get_pixel(x, y).0;
            image::Rgba([r, g, b, alpha(x, y)])
        })
    };
    check("alpha of 255 all over", chain(&hills, png(with_alpha(|_, _| 255))), &plain, same, "");
    check(
        "alpha with holes",
        chain(&hills, png(with_alpha(|x, y| if (x / 16 + y / 16) % 4 == 0 { 0 } else { 255 }))),
        &plain,
        &[("colour RMS", f64::INFINITY), ("leaf colour", f64::INFINITY)],
        "kept without loss; nothing is seen in holes",
    );

    let usual_picture = || png(picture(256, 256));
    check(
        "UV moved by 1e6",
        chain(&mapped(|_, [u, v]| [u + 1e6, v - 1e6]), usual_picture()),
        &plain,
        same,
        "",
    );
    check(
        "UV negative",
        chain(&mapped(|_, [u, v]| [u - 17.0, v - 3.0]), usual_picture()),
        &plain,
        same,
        "",
    );
    let untextured = Shape::hills().without_texture();
    let all =
        (0..4).map(|shake| figures(&chain(&untextured.clone().shaken(shake), usual_picture())));
    let white = Twin::several("without texture", all.collect());
    check("UV of NaN", chain(&mapped(|_, _| [f64::NAN; 2]), usual_picture()), &white, same, "");
    // v runs upwards.
    let at = paint(128.5 / 256.0, 127.5 / 256.0);
    let of_one = several("64 × 64 of that colour", one(at));
    check(
        "UV all equal",
        chain(&mapped(|_, _| [0.501; 2]), usual_picture()),
        &of_one,
        colorless,
        colors,
    );
    check(
        "UV within one texel",
        chain(&mapped(|_, [u, v]| [0.5 + (u + 1.0) * 1e-3, 0.499 - v * 1e-3]), usual_picture()),
        &of_one,
        colorless,
        colors,
    );
    check(
        "one chart of a texel among others",
        chain(&mapped(|n, uv| if n < 3 { [0.501; 2] } else { uv }), usual_picture()),
        &plain,
        // Three triangles of one colour and what is made of them add 3 of 255 in squares; all others
        // are off by 4, so that this is seen.
        &[("colour RMS", 0.2)],
        "the chart is torn there",
    );
    table.finish();
}
