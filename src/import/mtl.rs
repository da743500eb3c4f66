//! MTL: material libraries of OBJ.
//!
//! The importer reads `Kd`, `d`, `Tr`, `map_Kd` and `map_d` (or `map_opacity`, as OpenSceneGraph
//! calls it); one that cannot be read costs no other. The first definition of a name
//! counts, in one library and in several: of several libraries the format has the first searched
//! first, and tinyobjloader does the same within each; Blender takes the last. The alpha channel of
//! a `map_Kd` counts where `map_d` names the same file or `d` is below 1, as in three.js; Blender
//! and obj2gltf ignore it without a `map_d` too.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use encoding_rs::Encoding;

use super::lines::Lines;
use super::names::{self, folded, forms, unescaped, without_comment};
use super::opacity::Opacity;
use super::paths::Finder;
use super::plain_text::PlainText;
use super::texture_statement::{TextureStatement, has_udim};
use super::textures::Textures;
use super::tokens::word;
use crate::color::srgb_to_linear;
use crate::mesh::{AlphaMode, Material, Warnings, Wrap};

/// Alpha below this is a hole where a material has a `map_d` of two values.
const CUTOFF: f32 = 0.5;

/// Components of `Kd` may be so far outside 0 to 1: half a step of 8 bits.
const COLOR_ROUNDING: f64 = 1.0 / 510.0;

/// A material and what becomes of the texture coordinates that its faces give.
#[derive(Clone, Debug)]
pub(super) struct MtlMaterial {
    pub(super) material: Material,
    pub(super) transform: UvTransform,
    /// The library gives its colour or a texture; otherwise the colour is a default.
    pub(super) has_color: bool,
    /// Its textures are UDIM tiles: faces take the material of their tile (see [`Library::tile`]).
    pub(super) is_tiled: bool,
}

/// From here on f32 has less than 2^-16 of a repeat.
const FAR_OUT: f64 = 256.0;

impl MtlMaterial {
    /// Grey, without a texture.
    pub(super) fn plain(name: impl Into<String>) -> Self {
        Self {
            material: Material::plain(name),
            transform: UvTransform::default(),
            has_color: false,
            is_tiled: false,
        }
    }

    /// How many whole repeats of a texture lie before a texture coordinate that is so far out that
    /// f32 would lose part of it: the texture is the same without them. Even, so that one that is
    /// mirrored is too.
    pub(super) fn whole_repeats(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let exact = |axis: usize, at: f64| {
            let at = at * self.transform.scale[axis] + self.transform.offset[axis];
            let at = if axis == 1 { 1.0 - at } else { at };
            let far = at.abs() > FAR_OUT && self.material.wrap[axis] != Wrap::Clamp;
            if far { 2.0 * (at / 2.0).round() } else { 0.0 }
        };
        [exact(0, u), exact(1, v)]
    }
}

/// MTL's `-s` and `-o`: u′ = u·scale + offset, in OBJ's orientation (v upwards).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct UvTransform {
    pub(super) scale: [f64; 2],
    pub(super) offset: [f64; 2],
}

impl Default for UvTransform {
    fn default() -> Self {
        Self { scale: [1.0; 2], offset: [0.0; 2] }
    }
}

impl UvTransform {
    /// The texture coordinate with v upwards.
    fn upwards(&self, uv: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| uv[axis] * self.scale[axis] + self.offset[axis])
    }

    /// The texture coordinate, v downwards, `back` repeats of the texture further back.
    pub(super) fn apply(&self, uv: [f64; 2], back: [f64; 2]) -> [f32; 2] {
        let [u, v] = self.upwards(uv);
        [(u - back[0]) as f32, (1.0 - v - back[1]) as f32]
    }
}

/// The UDIM tile of the square from 0 to 1.
pub(super) const FIRST_TILE: u32 = 1001;

/// Columns of UDIM tiles.
const TILE_COLUMNS: f64 = 10.0;

/// Rows of UDIM tiles: numbers of four digits.
const TILE_ROWS: f64 = 899.0;

/// Texture coordinates may reach so far into the next UDIM tile: rounding.
const TILE_TOLERANCE: f64 = 1e-3;

/// A UDIM tile, and whether a face lies within it.
pub(super) struct Tile {
    pub(super) number: u32,
    pub(super) holds_face: bool,
}

impl MtlMaterial {
    /// The tile of a face with these texture coordinates; `None` where no tile has a number.
    pub(super) fn tile_of(&self, texcoords: impl Iterator<Item = [f64; 2]>) -> Option<Tile> {
        let none = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
        let [low, high] = texcoords.map(|uv| self.transform.upwards(uv)).fold(none, |all, uv| {
            [0, 1].map(|end| {
                let nearer = [f64::min, f64::max][end];
                [nearer(all[end][0], uv[0]), nearer(all[end][1], uv[1])]
            })
        });
        let [column, row] = [0, 1].map(|axis| ((low[axis] + high[axis]) / 2.0).floor());
        if !(0.0..TILE_COLUMNS).contains(&column) || !(0.0..TILE_ROWS).contains(&row) {
            return None;
        }
        let holds_face =
            [column, row].iter().zip(low.iter().zip(&high)).all(|(tile, (low, high))| {
                *low >= tile - TILE_TOLERANCE && *high <= tile + 1.0 + TILE_TOLERANCE
            });
        Some(Tile { number: FIRST_TILE + (column + TILE_COLUMNS * row) as u32, holds_face })
    }
}

/// What a library says of its materials; they are made when a face uses them, so that what no face
/// uses costs nothing and warns of nothing.
#[derive(Default)]
pub(super) struct Library {
    materials: Vec<Entry>,
    /// By name, the first definition.
    by_name: BTreeMap<Vec<u8>, usize>,
    /// By [`comparable`] name.
    by_comparable: BTreeMap<Vec<u8>, usize>,
    /// By [`comparable`] name without the comment behind it.
    by_bare: BTreeMap<Vec<u8>, usize>,
}

/// A material as a library defines it.
struct Entry {
    name: Vec<u8>,
    /// The encoding of names that are not UTF-8.
    encoding: Option<&'static Encoding>,
    statements: Statements,
}

/// The statements of a material, each the last of its kind.
#[derive(Debug, Default, PartialEq)]
struct Statements {
    /// `Kd`, sRGB.
    diffuse: Option<[f64; 3]>,
    /// Statements whose values cannot be read or that have a meaning which import does not know.
    unread: BTreeSet<Vec<u8>>,
    /// `d`.
    dissolve: Option<f64>,
    /// `d -halo`.
    has_halo: bool,
    /// `Tr`, which is 1 − `d`.
    transparency: Option<f64>,
    /// `map_Kd`.
    diffuse_map: Option<Vec<u8>>,
    /// `map_d`.
    opacity_map: Option<Vec<u8>>,
}

impl Statements {
    /// Takes a statement in, whose keyword is in lower case; one that does not matter or cannot be
    /// read changes nothing.
    fn add(&mut self, keyword: &[u8], mut rest: &[u8]) {
        let map = (!rest.is_empty()).then(|| rest.to_vec());
        match keyword {
            b"kd" => match color(rest) {
                Some(color) => self.diffuse = Some(color),
                None => _ = self.unread.insert([b"Kd ", rest].concat()),
            },
            b"d" => {
                let mut values = rest;
                let has_halo = word(&mut values).is_some_and(|word| word == b"-halo");
                let value = number(if has_halo { &mut values } else { &mut rest });
                if value.is_some() {
                    (self.dissolve, self.has_halo) = (value, has_halo);
                }
            }
            b"tr" => self.transparency = number(&mut rest).or(self.transparency),
            b"map_kd" => self.diffuse_map = map.or_else(|| self.diffuse_map.take()),
            b"map_d" | b"map_opacity" => self.opacity_map = map.or_else(|| self.opacity_map.take()),
            // Exporters do not agree on whether white is opaque in it.
            b"map_tr" => _ = self.unread.insert([b"map_Tr ", rest].concat()),
            _ => {}
        }
    }
}

/// The values of `Kd`: red, green and blue, or one value for all three. `None` for what is neither,
/// as the forms `xyz` and `spectral`.
fn color(rest: &[u8]) -> Option<[f64; 3]> {
    let words = rest.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
    let words = words.take_while(|word| word[0] != b'#').take(3);
    let values: Option<Vec<f64>> = words.map(|mut word| number(&mut word)).collect();
    match values?[..] {
        [grey] => Some([grey; 3]),
        [r, g, b] => Some([r, g, b]),
        _ => None,
    }
}

/// Splits a number off the front of `rest`.
fn number(rest: &mut &[u8]) -> Option<f64> {
    std::str::from_utf8(word(rest)?).ok()?.parse().ok()
}

/// A material's name without what is no difference between names.
fn comparable(name: &[u8]) -> Vec<u8> {
    let mut words = folded(&unescaped(name));
    words.iter_mut().filter(|byte| **byte < b' ').for_each(|byte| *byte = b' ');
    words.dedup_by(|next, byte| (*next, *byte) == (b' ', b' '));
    words
}

impl Library {
    /// Adds the materials of a library file's bytes, whose names are probably in the encoding of
    /// the model's.
    pub(super) fn add(&mut self, bytes: &[u8], of_model: Option<&'static Encoding>) {
        let text = PlainText::of_bytes(bytes).unwrap_or_default();
        let encoding = std::str::from_utf8(&text).is_err().then(|| {
            let is_valid = |encoding: &&'static Encoding| {
                encoding.decode_without_bom_handling_and_without_replacement(&text).is_some()
            };
            of_model.filter(is_valid).unwrap_or_else(|| names::guess(&text))
        });
        let mut lines = Lines::new(&text[..]);
        let mut current: Option<usize> = None;
        while let Ok(Some((_, line))) = lines.next() {
            let mut rest = line;
            let Some(keyword) = word(&mut rest) else { continue };
            let keyword = keyword.to_ascii_lowercase();
            let rest = rest.trim_ascii();
            if keyword == b"newmtl" {
                current = Some(self.materials.len());
                self.define(rest, encoding);
            } else if let Some(number) = current {
                self.materials[number].statements.add(&keyword, rest);
            }
        }
    }

    /// Begins a material.
    fn define(&mut self, name: &[u8], encoding: Option<&'static Encoding>) {
        let number = self.materials.len();
        let statements = Statements::default();
        self.materials.push(Entry { name: name.to_vec(), encoding, statements });
        self.by_name.entry(name.to_vec()).or_insert(number);
        self.by_comparable.entry(comparable(name)).or_insert(number);
        let bare = without_comment(name);
        if bare.len() < name.len() {
            self.by_bare.entry(comparable(bare)).or_insert(number);
        }
    }

    /// The names of `used` whose materials are defined again with other statements, each once.
    pub(super) fn redefined<'a>(&self, used: impl Iterator<Item = &'a [u8]>) -> Vec<&'a [u8]> {
        let is_other = |(number, entry): &(usize, &Entry)| {
            let first = self.by_name[&entry.name];
            first != *number && self.materials[first].statements != entry.statements
        };
        let entries = self.materials.iter().enumerate();
        let others: BTreeSet<&[u8]> =
            entries.filter(is_other).map(|(_, entry)| &entry.name[..]).collect();
        if others.is_empty() {
            return Vec::new();
        }
        let mut known = BTreeSet::new();
        used.filter(|name| {
            let defined = self.meant(name).map(|entry| &entry.name[..]);
            defined.is_some_and(|defined| others.contains(defined) && known.insert(defined))
        })
        .collect()
    }

    /// The material that a name means: the one of that very name; else one whose name differs in
    /// its encoding, normal form, case or white space alone, or by the comment behind it.
    fn meant(&self, name: &[u8]) -> Option<&Entry> {
        let bare = without_comment(name);
        let names = [name, bare];
        let names = &names[..if bare.len() < name.len() { 2 } else { 1 }];
        let equal = names.iter().find_map(|name| self.by_name.get(*name));
        let similar = || {
            names.iter().flat_map(|name| forms(name)).find_map(|form| {
                let comparable = comparable(&form.name);
                self.by_comparable.get(&comparable).or_else(|| self.by_bare.get(&comparable))
            })
        };
        equal.or_else(similar).map(|number| &self.materials[*number])
    }

    /// Makes the material `name` of what the library says; `None` where it says nothing. One whose
    /// textures are UDIM tiles has none of them.
    pub(super) fn material(
        &self,
        name: &[u8],
        model: &Path,
        finder: &mut Finder,
        textures: &mut Textures,
        warnings: &mut Warnings,
    ) -> Option<MtlMaterial> {
        let entry = self.meant(name)?;
        let source = &entry.statements;
        let maps = [&source.diffuse_map, &source.opacity_map];
        if maps.into_iter().flatten().any(|map| has_udim(map)) {
            let parsed = source.diffuse_map.as_ref().or(source.opacity_map.as_ref());
            let transform = parsed.map(|map| TextureStatement::parse(map, finder).transform);
            let mut base = entry.plain(name, finder);
            base.transform = transform.unwrap_or_default();
            (base.is_tiled, base.has_color) = (true, true);
            if let Some(color) =
                source.diffuse.filter(|color| color.iter().all(|at| at.is_finite()))
            {
                set_color(&mut base.material, color);
            }
            return Some(base);
        }
        Some(entry.material(name, None, model, finder, textures, warnings))
    }

    /// Makes the material `name` with the textures of a UDIM tile, whose texture coordinates are
    /// moved to 0–1.
    pub(super) fn tile(
        &self,
        name: &[u8],
        tile: u32,
        model: &Path,
        finder: &mut Finder,
        textures: &mut Textures,
        warnings: &mut Warnings,
    ) -> Option<MtlMaterial> {
        let entry = self.meant(name)?;
        let mut made = entry.material(name, Some(tile), model, finder, textures, warnings);
        let number = f64::from(tile - FIRST_TILE);
        made.transform.offset[0] -= number % TILE_COLUMNS;
        made.transform.offset[1] -= (number / TILE_COLUMNS).floor();
        made.material.wrap = [Wrap::Clamp; 2];
        made.material.name = format!("{}.{tile}", made.material.name);
        Some(made)
    }
}

impl Entry {
    /// The material, which a face calls `used`, without colour and textures. Its name is that of the
    /// library, or of the model where that alone is UTF-8.
    fn plain(&self, used: &[u8], finder: &Finder) -> MtlMaterial {
        let encoding = self.encoding(finder);
        let is_utf_8 = |name: &[u8]| std::str::from_utf8(name).is_ok();
        let name = match encoding.is_some() && used != self.name && is_utf_8(used) {
            true => names::display(used, None),
            false => names::display(&self.name, encoding),
        };
        MtlMaterial::plain(name)
    }

    /// The likely encoding of the library's names where they are not UTF-8: one in which a file was
    /// found, if there is.
    fn encoding(&self, finder: &Finder) -> Option<&'static Encoding> {
        self.encoding.map(|guess| finder.encoding().unwrap_or(guess))
    }

    fn material(
        &self,
        used: &[u8],
        tile: Option<u32>,
        model: &Path,
        finder: &mut Finder,
        textures: &mut Textures,
        warnings: &mut Warnings,
    ) -> MtlMaterial {
        let source = &self.statements;
        let mut result = self.plain(used, finder);
        let material = &mut result.material;
        let name = material.name.clone();
        let mut warn =
            |what: String| warnings.add(format!("{}: material {name}: {what}", model.display()), 1);

        let mut read = |map: &Option<Vec<u8>>| {
            let statement = TextureStatement::of_tile(map.as_deref()?, tile, finder);
            let shown = names::display(&unescaped(&statement.name), self.encoding(finder));
            if statement.file.is_none() {
                warn(format!("texture {shown} {}", finder.why_missing(&statement.name)));
            }
            if let Some(what) = statement.problem {
                warn(format!("texture {shown}: {what}"));
            }
            Some((shown, statement))
        };
        let color_map = read(&source.diffuse_map);
        let opacity_map = read(&source.opacity_map);
        let color_file = color_map.as_ref().and_then(|(_, map)| map.file.clone());
        let opacity_file = opacity_map.as_ref().and_then(|(shown, map)| {
            let file = map.file.clone()?;
            let is_own_alpha = Some(&file) == color_file.as_ref();
            let problem = match textures.opacity(&file, is_own_alpha) {
                Ok(Opacity::Opaque) => return None,
                Ok(Opacity::Mask) => {
                    material.alpha = AlphaMode::Mask { cutoff: CUTOFF };
                    return Some(file);
                }
                Ok(Opacity::Blend) => {
                    material.alpha = AlphaMode::Blend;
                    return Some(file);
                }
                Ok(Opacity::Transparent) => "would be invisible, taken as opaque".to_owned(),
                Err(what) => format!("ignored: {what}"),
            };
            warn(format!("map_d {shown} {problem}"));
            None
        });
        if let (Some((_, color)), Some((_, opacity)), Some(_)) =
            (&color_map, &opacity_map, &opacity_file)
            && color.transform != opacity.transform
        {
            warn("-s and -o of map_d differ from those of map_Kd, ignored".into());
        }
        let used_map = if color_file.is_some() { &color_map } else { &opacity_map };
        if let Some((shown, map)) = used_map
            && (color_file.is_some() || opacity_file.is_some())
        {
            result.transform = map.transform;
            material.wrap = [if map.is_clamped { Wrap::Clamp } else { Wrap::Repeat }; 2];
            material.texture = Some(match color_file.clone() {
                Some(file) => {
                    let opacity = opacity_file.filter(|opacity| *opacity != file);
                    textures.file(shown, file, opacity)
                }
                None => textures.white(shown, opacity_file),
            });
        }

        let textured = color_file.is_some();
        match source.diffuse {
            // Exporters that leave the colour at its default beside a texture mean the texture.
            Some([0.0, 0.0, 0.0]) if textured => {
                warn("black Kd beside a texture, taken as white".into());
                set_color(material, [1.0; 3]);
            }
            Some(color) if color.iter().all(|part| part.is_finite()) => set_color(material, color),
            Some(_) => warn("Kd is not finite, ignored".into()),
            None if textured || source.diffuse_map.is_some() => set_color(material, [1.0; 3]),
            None => {}
        }
        for statement in &source.unread {
            let statement = names::display(statement, self.encoding(finder));
            warn(format!("\"{}\" is not read", statement.trim_end()));
        }
        result.has_color = source.diffuse.is_some() || source.diffuse_map.is_some();
        if source.has_halo {
            warn("d -halo taken as d".into());
        }
        let dissolve = source.dissolve.or(source.transparency.map(|value| 1.0 - value));
        match dissolve.filter(|value| value.is_finite()) {
            Some(value) if value <= 0.0 => {
                warn("d 0 (or Tr 1) would be invisible, taken as opaque".into());
            }
            Some(value) if value < 1.0 => {
                material.base_color[3] = value as f32;
                // Also where the map has two values: a cutoff would make holes of all.
                material.alpha = AlphaMode::Blend;
            }
            _ => {}
        }
        if source.diffuse.is_some_and(is_out_of_range) {
            let what = "material with Kd outside 0 to 1, clamped; divide values of 0 to 255 by 255";
            warnings.add(format!("{}: {what}", model.display()), 1);
        }
        result
    }
}

/// True for a finite colour with a component outside 0 to 1 by more than rounding.
fn is_out_of_range(color: [f64; 3]) -> bool {
    let is_outside = |part: &f64| !(-COLOR_ROUNDING..=1.0 + COLOR_ROUNDING).contains(part);
    color.iter().all(|part| part.is_finite()) && color.iter().any(is_outside)
}

fn set_color(material: &mut Material, color: [f64; 3]) {
    for (to, from) in material.base_color.iter_mut().zip(color) {
        *to = srgb_to_linear(from) as f32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An image of 8 x 8 texels with this alpha in its left half and 1 in the other.
    fn image(alpha: u8) -> image::DynamicImage {
        let texel = |x, _| image::Rgba([200, 90, 30, if x < 4 { alpha } else { 255 }]);
        image::RgbaImage::from_fn(8, 8, texel).into()
    }

    /// Reads a material beside these files: of opacity 0, 0.4 and 1 in their left half where their
    /// names begin with `hole`, `glass` and anything else, and of text where with `text`.
    fn read(
        mtl: impl AsRef<[u8]>,
        name: impl AsRef<[u8]>,
        files: &[&str],
    ) -> (MtlMaterial, Textures, Vec<String>) {
        let folder = tempfile::tempdir().unwrap();
        for file in files {
            let path = folder.path().join(file);
            match &file[..4] {
                "text" => std::fs::write(path, "text").unwrap(),
                "hole" => image(0).save(path).unwrap(),
                "glas" => image(102).save(path).unwrap(),
                _ => image(255).to_rgb8().save(path).unwrap(),
            }
        }
        let mut library = Library::default();
        library.add(mtl.as_ref(), None);
        let model = folder.path().join("city.obj");
        let (mut textures, mut warnings) = (Textures::default(), Warnings::default());
        let mut finder = Finder::new(&model);
        let material = library
            .material(name.as_ref(), &model, &mut finder, &mut textures, &mut warnings)
            .unwrap();
        (material, textures, warnings.iter().map(|(what, _)| what.to_owned()).collect())
    }

    #[test]
    fn the_transform_comes_before_the_flip() {
        let transform = UvTransform { scale: [2.0, 4.0], offset: [0.5, 0.25] };
        assert_eq!(transform.apply([1.0, 0.125], [0.0; 2]), [2.5, 0.25]);
        assert_eq!(UvTransform::default().apply([0.25, 0.25], [0.0; 2]), [0.25, 0.75]);
    }

    #[test]
    fn colours_are_linear_and_opacity_is_kept() {
        let mtl = "newmtl a\nKd 0.5 1 0\nnewmtl b\n Kd 1 1 1\n\tTr 0.25\nnewmtl c\nd 0\n";
        let (material, ..) = read(mtl, "a", &[]);
        let [r, g, b, a] = material.material.base_color;
        assert!((r - 0.21404).abs() < 1e-5 && [g, b, a] == [1.0, 0.0, 1.0]);
        assert_eq!(material.material.alpha, AlphaMode::Opaque);
        let (material, ..) = read(mtl, "b", &[]);
        assert_eq!(material.material.base_color, [1.0, 1.0, 1.0, 0.75]);
        assert_eq!(material.material.alpha, AlphaMode::Blend);
        let (material, _, warnings) = read(mtl, "c", &[]);
        assert_eq!(material.material, Material::plain("c"));
        assert!(warnings[0].contains("taken as opaque"));
    }

    const CUT_OUT: AlphaMode = AlphaMode::Mask { cutoff: CUTOFF };

    #[test]
    fn opacity_maps_cut_out_blend_or_do_nothing() {
        let mtl = |statements: &str| format!("newmtl a\nKd 0.5 1 0\n{statements}\n");
        let files = ["hole.png", "glass.png", "wall.png", "text.png"];
        for (statements, alpha, has_opacity_file) in [
            ("map_Kd wall.png", AlphaMode::Opaque, false),
            ("map_Kd hole.png", AlphaMode::Opaque, false),
            ("map_Kd hole.png\nmap_d HOLE.PNG", CUT_OUT, false),
            ("map_Kd glass.png\nmap_d glass.png", AlphaMode::Blend, false),
            ("map_Kd wall.png\nmap_d wall.png", AlphaMode::Opaque, false),
            ("map_Kd wall.png\nmap_d hole.png", CUT_OUT, true),
            ("map_Kd wall.png\nmap_d -imfchan m glass.png -bm 2", AlphaMode::Blend, true),
            ("map_Kd wall.png\nmap_d hole.png\nd 0.5", AlphaMode::Blend, true),
            ("map_d hole.png", CUT_OUT, true),
            ("map_d glass.png", AlphaMode::Blend, true),
        ] {
            let (material, textures, warnings) = read(mtl(statements), "a", &files);
            assert_eq!(material.material.alpha, alpha, "{statements}");
            let [texture] = &textures.list[..] else { panic!("{:?}", textures.list) };
            assert_eq!(texture.opacity.is_some(), has_opacity_file, "{statements}");
            assert!(warnings.is_empty(), "{warnings:?}");
            assert!((material.material.base_color[0] - 0.21404).abs() < 1e-5, "Kd stays");
        }
        for (statements, warning) in [
            ("map_Kd wall.png\nmap_d gone.png", "texture gone.png not found"),
            ("map_Kd wall.png\nmap_d text.png", "map_d text.png ignored: "),
            ("map_Kd wall.png\nmap_d hole.png -s 2 2", "differ from those of map_Kd"),
        ] {
            let (material, textures, warnings) = read(mtl(statements), "a", &files);
            assert!(warnings[0].contains(warning), "{warnings:?}");
            assert_eq!(material.material.texture, Some(0));
            let is_kept = statements.contains("hole");
            assert_eq!(textures.list[0].opacity.is_some(), is_kept, "{statements}");
        }
    }

    #[test]
    fn an_opacity_map_alone_is_on_white() {
        let folder = tempfile::tempdir().unwrap();
        let map = folder.path().join("hole.png");
        image(0).save(&map).unwrap();
        let mut textures = Textures::default();
        textures.white("hole.png", Some(map));
        let image = crate::decode::decode_texture(&textures.list[0]).unwrap();
        assert_eq!((image.width, image.height, image.channels), (8, 8, 4));
        let texels = image.pixels.as_chunks::<4>().0;
        assert!(texels.iter().all(|texel| texel[..3] == [255; 3]));
        assert_eq!([texels[0][3], texels[7][3]], [0, 255]);
    }

    #[test]
    fn halos_count_as_plain_opacity() {
        let (material, _, warnings) = read("newmtl a\nd -halo 0.4\n", "a", &[]);
        assert_eq!(material.material.base_color[3], 0.4);
        assert_eq!(material.material.alpha, AlphaMode::Blend);
        assert!(warnings[0].contains("d -halo taken as d"), "{warnings:?}");
    }

    #[test]
    fn names_are_found_in_other_encodings_and_case_and_with_comments() {
        let gbk = |text: &str| encoding_rs::GBK.encode(text).0.into_owned();
        let library = |name: &[u8]| [b"newmtl ", name, b"\nKd 1 0 0\n"].concat();
        let utf_16 = |text: &str| -> Vec<u8> {
            format!("\u{feff}{text}").encode_utf16().flat_map(u16::to_le_bytes).collect()
        };
        for (mtl, name) in [
            (library(&gbk("墙")), gbk("墙")),
            (library(&gbk("墙")), "墙".into()),
            (library("墙".as_bytes()), gbk("墙")),
            (utf_16("newmtl 墙\nKd 1 0 0\n"), gbk("墙")),
            (library("Caf\u{e9}".as_bytes()), "CAFE\u{301}".into()),
            (library(b"my wall"), b"\"My\tWall\"".to_vec()),
            (library(b"wall # red"), b"wall # red".to_vec()),
            (library(b"wall # red"), b"wall".to_vec()),
            (library(b"wall"), b"wall # red".to_vec()),
            (b"NEWMTL wall\rKD 1 0 0\r".to_vec(), b"wall".to_vec()),
            (b"\xef\xbb\xbfnewmtl wall\r\n\tkD 1 \\\r\n0 0\r\n".to_vec(), b"wall".to_vec()),
        ] {
            let (material, ..) = read(&mtl, &name, &[]);
            assert_eq!(material.material.base_color, [1.0, 0.0, 0.0, 1.0], "{mtl:?} {name:?}");
        }
        let both = [library(b"Wall"), b"newmtl wall\nKd 0 1 0\n".to_vec()].concat();
        assert_eq!(read(&both, "Wall", &[]).0.material.base_color, [1.0, 0.0, 0.0, 1.0]);
        assert_eq!(read(&both, "wall", &[]).0.material.base_color, [0.0, 1.0, 0.0, 1.0]);
        let both = [library(b"wall # 1"), b"newmtl wall # 2\nKd 0 1 0\n".to_vec()].concat();
        assert_eq!(read(&both, "wall # 1", &[]).0.material.base_color, [1.0, 0.0, 0.0, 1.0]);
    }

    #[test]
    fn a_missing_texture_leaves_the_colour() {
        let (material, textures, warnings) = read("newmtl a\nKd 0 1 0\nmap_Kd x.png\n", "a", &[]);
        assert_eq!(material.material.texture, None);
        assert_eq!(material.material.base_color, [0.0, 1.0, 0.0, 1.0]);
        assert!(textures.list.is_empty());
        assert!(warnings[0].contains("x.png not found"));
    }

    #[test]
    fn broken_statements_cost_nothing_else() {
        let mtl = "Kd 1\nnewmtl\nnewmtl a\nKd 0.5\nKd red\nd\nmap_Kd\nKd 1 0 0\nnewmtl b\nKd 0 0 1";
        assert_eq!(read(mtl, "a", &[]).0.material.base_color, [1.0, 0.0, 0.0, 1.0]);
        assert_eq!(read(mtl, "b", &[]).0.material.base_color, [0.0, 0.0, 1.0, 1.0]);
    }

    #[test]
    fn one_value_of_kd_is_grey_and_other_forms_are_named() {
        for (statement, color) in
            [("Kd 0.5", [0.5; 3]), ("Kd 0.5 # 1 1", [0.5; 3]), ("Kd 0 1 0.5 1", [0.0, 1.0, 0.5])]
        {
            let (material, _, warnings) = read(format!("newmtl a\n{statement}\n"), "a", &[]);
            let expected = color.map(|part| srgb_to_linear(part) as f32);
            assert_eq!(material.material.base_color[..3], expected, "{statement}");
            assert!(warnings.is_empty(), "{warnings:?}");
        }
        let plain = Material::plain("a").base_color;
        for statement in
            ["Kd spectral a.rfl 1", "Kd xyz 0.1 0.2 0.3", "Kd 0.5 1", "Kd", "map_Tr t.png"]
        {
            let (material, _, warnings) = read(format!("newmtl a\n{statement}\n"), "a", &["t.png"]);
            assert_eq!(material.material.base_color, plain, "{statement}");
            let [warning] = &warnings[..] else { panic!("{warnings:?}") };
            assert!(
                warning.ends_with(&format!("material a: \"{statement}\" is not read")),
                "{warning}"
            );
        }
    }

    #[test]
    fn colours_outside_0_to_1_are_warned_of() {
        for (values, is_warned) in [
            ("255 128 0", true),
            ("0.5 -0.1 0", true),
            ("1.001 0 -0.0001", false),
            ("0 nan 9", false),
        ] {
            let (.., warnings) = read(format!("newmtl a\nKd {values}\n"), "a", &[]);
            let found = warnings.iter().any(|warning| warning.contains("Kd outside 0 to 1"));
            assert_eq!(found, is_warned, "{values}: {warnings:?}");
        }
    }

    #[test]
    fn map_opacity_is_map_d() {
        let mtl = "newmtl a\nmap_Kd wall.png\nmap_opacity hole.png\n";
        let (material, textures, warnings) = read(mtl, "a", &["wall.png", "hole.png"]);
        assert_eq!(material.material.alpha, CUT_OUT);
        assert!(textures.list[0].opacity.is_some() && warnings.is_empty(), "{warnings:?}");
    }

    #[test]
    fn scales_that_hide_a_texture_are_warned_of() {
        for (options, scale, warning) in [
            ("-s 0 0 0", [0.0, 0.0], "-s of 0"),
            ("-s 2 0 1", [2.0, 0.0], "-s of 0"),
            ("-s 1e30 2", [1.0, 1.0], "both ignored"),
            ("-s 2 2 -o 0 -1e30", [1.0, 1.0], "both ignored"),
        ] {
            let mtl = format!("newmtl a\nmap_Kd {options} wall.png\n");
            let (material, _, warnings) = read(mtl, "a", &["wall.png"]);
            assert_eq!(material.transform.scale, scale, "{options}");
            assert!(warnings[0].contains(warning), "{options}: {warnings:?}");
        }
    }
}
