//! MTL: material libraries of OBJ.
//!
//! Of its statements `Kd`, `d`, `Tr`, `map_Kd` and `map_d` matter here; one that cannot be read
//! costs no other.

use std::collections::BTreeMap;
use std::path::Path;

use super::lines::{Lines, text};
use super::paths::Finder;
use super::textures::Textures;
use crate::color::srgb_to_linear;
use crate::mesh::{AlphaMode, Material, Warnings, Wrap};

/// Alpha below this is a hole where a material has a `map_d`.
const CUTOFF: f32 = 0.5;

/// A material and what becomes of the texture coordinates that its faces give.
#[derive(Clone, Debug)]
pub(super) struct MtlMaterial {
    pub(super) material: Material,
    pub(super) transform: UvTransform,
}

/// From here on f32 has less than 2^-16 of a repeat.
const FAR_OUT: f64 = 256.0;

impl MtlMaterial {
    /// Grey, without a texture.
    pub(super) fn plain(name: &str) -> Self {
        Self { material: Material::plain(name), transform: UvTransform::default() }
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
    /// The texture coordinate, v downwards, `back` repeats of the texture further back.
    pub(super) fn apply(&self, [u, v]: [f64; 2], back: [f64; 2]) -> [f32; 2] {
        let u = u * self.scale[0] + self.offset[0];
        let v = v * self.scale[1] + self.offset[1];
        [(u - back[0]) as f32, (1.0 - v - back[1]) as f32]
    }
}

/// What a library says of its materials; they are made when a face uses them, so that what no face
/// uses costs nothing and warns of nothing.
#[derive(Default)]
pub(super) struct Library {
    /// The last definition of a name counts.
    materials: BTreeMap<String, Statements>,
}

/// The statements of a material, each the last of its kind.
#[derive(Debug, Default)]
struct Statements {
    /// `Kd`, sRGB.
    diffuse: Option<[f64; 3]>,
    /// `d`.
    dissolve: Option<f64>,
    /// `Tr`, which is 1 − `d`.
    transparency: Option<f64>,
    /// `map_Kd`.
    diffuse_map: Option<TextureStatement>,
    /// `map_d`.
    opacity_map: Option<TextureStatement>,
}

impl Statements {
    /// Takes a statement in; one that does not matter or cannot be read changes nothing.
    fn add(&mut self, keyword: &str, rest: &str) {
        let mut numbers = rest.split_whitespace().map_while(|word| word.parse::<f64>().ok());
        let map = || (!rest.is_empty()).then(|| TextureStatement::parse(rest));
        match keyword {
            "Kd" => {
                if let (Some(r), Some(g), Some(b)) =
                    (numbers.next(), numbers.next(), numbers.next())
                {
                    self.diffuse = Some([r, g, b]);
                }
            }
            "d" => self.dissolve = numbers.next().or(self.dissolve),
            "Tr" => self.transparency = numbers.next().or(self.transparency),
            "map_Kd" => self.diffuse_map = map().or_else(|| self.diffuse_map.take()),
            "map_d" => self.opacity_map = map().or_else(|| self.opacity_map.take()),
            _ => {}
        }
    }
}

impl Library {
    /// Adds the materials of a library file's bytes.
    pub(super) fn add(&mut self, bytes: &[u8]) {
        let mut lines = Lines::new(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes));
        let mut current: Option<&mut Statements> = None;
        while let Ok(Some((_, line))) = lines.next() {
            let line = text(line);
            let line = line.trim();
            let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
            let rest = rest.trim();
            if keyword == "newmtl" {
                let entry = self.materials.entry(rest.to_owned()).or_default();
                *entry = Statements::default();
                current = Some(entry);
            } else if let Some(statements) = &mut current {
                statements.add(keyword, rest);
            }
        }
    }

    /// Makes the material `name` of what the library says; `None` where it says nothing.
    pub(super) fn material(
        &self,
        name: &str,
        model: &Path,
        finder: &mut Finder,
        textures: &mut Textures,
        warnings: &mut Warnings,
    ) -> Option<MtlMaterial> {
        let source = self.materials.get(name)?;
        let mut warn =
            |what: String| warnings.add(format!("{}: material {name}: {what}", model.display()), 1);
        let mut result = MtlMaterial::plain(name);
        let material = &mut result.material;
        let opacity_map = source.opacity_map.as_ref();
        if let Some(statement) = &source.diffuse_map {
            let mut find = |wanted: &str| {
                let found = finder.find(wanted);
                if found.is_none() {
                    warn(format!("texture {wanted} not found"));
                }
                found
            };
            if let Some(file) = find(&statement.file) {
                let mask = opacity_map.and_then(|statement| find(&statement.file));
                if mask.is_some() {
                    material.alpha = AlphaMode::Mask { cutoff: CUTOFF };
                }
                let opacity = mask.filter(|mask| *mask != file);
                material.texture = Some(textures.file(&statement.file, file, opacity));
                material.wrap = [if statement.clamp { Wrap::Clamp } else { Wrap::Repeat }; 2];
                result.transform = statement.transform;
            }
        } else if opacity_map.is_some() {
            warn("map_d without map_Kd, ignored".into());
        }

        let textured = material.texture.is_some();
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
        let dissolve = source.dissolve.or(source.transparency.map(|value| 1.0 - value));
        match dissolve.filter(|value| value.is_finite()) {
            Some(value) if value <= 0.0 => {
                warn("d 0 (or Tr 1) would be invisible, taken as opaque".into());
            }
            Some(value) if value < 1.0 => {
                material.base_color[3] = value as f32;
                if material.alpha == AlphaMode::Opaque {
                    material.alpha = AlphaMode::Blend;
                }
            }
            _ => {}
        }
        Some(result)
    }
}

fn set_color(material: &mut Material, color: [f64; 3]) {
    for (to, from) in material.base_color.iter_mut().zip(color) {
        *to = srgb_to_linear(from) as f32;
    }
}

/// `map_Kd -s 2 2 1 -clamp on my facade.png`, taken apart.
#[derive(Debug, PartialEq)]
struct TextureStatement {
    file: String,
    transform: UvTransform,
    clamp: bool,
}

impl TextureStatement {
    fn parse(statement: &str) -> Self {
        let mut parsed =
            Self { file: String::new(), transform: UvTransform::default(), clamp: false };
        let mut rest = statement.trim();
        while let Some((option, mut values)) = take_option(rest) {
            match option {
                "-s" => parsed.transform.scale = take_vector(&mut values, 1.0),
                "-o" => parsed.transform.offset = take_vector(&mut values, 0.0),
                "-t" => {
                    take_vector(&mut values, 0.0);
                }
                "-clamp" => parsed.clamp = take_word(&mut values) == "on",
                "-mm" => {
                    take_word(&mut values);
                    take_word(&mut values);
                }
                _ => {
                    take_word(&mut values);
                }
            }
            rest = values;
        }
        parsed.file = rest.trim_matches('"').to_owned();
        parsed
    }
}

/// Options that the format defines for texture maps; anything else begins the file's name.
const OPTIONS: [&str; 13] = [
    "-s", "-o", "-t", "-clamp", "-blendu", "-blendv", "-cc", "-mm", "-bm", "-boost", "-texres",
    "-imfchan", "-type",
];

/// An option at the front of `rest`, and what follows it.
fn take_option(rest: &str) -> Option<(&str, &str)> {
    let (word, values) = rest.split_once(char::is_whitespace)?;
    OPTIONS.contains(&word).then(|| (word, values.trim_start()))
}

fn take_word<'a>(rest: &mut &'a str) -> &'a str {
    let (word, tail) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
    *rest = tail.trim_start();
    word
}

/// The first two of up to three numbers; those that are not there are `default`. The last word is
/// never one of them: it is the file's.
fn take_vector(rest: &mut &str, default: f64) -> [f64; 2] {
    let mut vector = [default; 3];
    for component in &mut vector {
        let Some((word, tail)) = rest.split_once(char::is_whitespace) else { break };
        let Some(value) = word.parse::<f64>().ok().filter(|value| value.is_finite()) else { break };
        *component = value;
        *rest = tail.trim_start();
    }
    [vector[0], vector[1]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TextureData;

    fn read(mtl: &str, name: &str, files: &[&str]) -> (MtlMaterial, Textures, Vec<String>) {
        let folder = tempfile::tempdir().unwrap();
        for file in files {
            std::fs::write(folder.path().join(file), "").unwrap();
        }
        let mut library = Library::default();
        library.add(mtl.as_bytes());
        let model = folder.path().join("city.obj");
        let (mut textures, mut warnings) = (Textures::default(), Warnings::default());
        let mut finder = Finder::new(&model);
        let material =
            library.material(name, &model, &mut finder, &mut textures, &mut warnings).unwrap();
        (material, textures, warnings.iter().map(|(what, _)| what.to_owned()).collect())
    }

    fn statement(text: &str) -> (String, [f64; 2], [f64; 2], bool) {
        let parsed = TextureStatement::parse(text);
        (parsed.file, parsed.transform.scale, parsed.transform.offset, parsed.clamp)
    }

    #[test]
    fn texture_options_are_taken_apart() {
        let plain = |file: &str| (file.to_owned(), [1.0; 2], [0.0; 2], false);
        assert_eq!(statement("my facade.png"), plain("my facade.png"));
        assert_eq!(statement("\"my facade.png\""), plain("my facade.png"));
        assert_eq!(statement("-bm 0.5 -mm 0 1 -type sphere -imfchan m a.png"), plain("a.png"));
        assert_eq!(statement("-x.png"), plain("-x.png"));
        assert_eq!(
            statement("-clamp on -s 2 3 1 -o 0.5 -0.25 b c.png"),
            ("b c.png".into(), [2.0, 3.0], [0.5, -0.25], true)
        );
        assert_eq!(statement("-s 2 4 5 6.png"), ("6.png".into(), [2.0, 4.0], [0.0; 2], false));
        assert_eq!(statement("-s 2 4 5"), ("5".into(), [2.0, 4.0], [0.0; 2], false));
        assert_eq!(statement("-s"), plain("-s"));
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

    #[test]
    fn opacity_maps_of_the_same_and_of_another_file() {
        let mtl =
            "newmtl same\nmap_Kd a.png\nmap_d A.PNG\nnewmtl other\nmap_Kd a.png\nmap_d m.png\n";
        let (material, textures, _) = read(mtl, "same", &["a.png", "m.png"]);
        assert_eq!(material.material.alpha, AlphaMode::Mask { cutoff: 0.5 });
        assert_eq!(material.material.base_color, [1.0; 4]);
        assert!(textures.list[0].opacity.is_none());
        let (material, textures, warnings) = read(mtl, "other", &["a.png", "m.png"]);
        assert_eq!(material.material.alpha, AlphaMode::Mask { cutoff: 0.5 });
        assert!(textures.list[0].opacity.as_ref().unwrap().ends_with("m.png"));
        assert!(
            matches!(&textures.list[0].data, TextureData::File(file) if file.ends_with("a.png"))
        );
        assert!(warnings.is_empty());
        let (material, _, warnings) = read(mtl, "other", &["a.png"]);
        assert_eq!(material.material.alpha, AlphaMode::Opaque);
        assert!(warnings[0].contains("material other: texture m.png not found"), "{warnings:?}");
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
}
