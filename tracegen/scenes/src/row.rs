//! A row of a scene's text: words that become numbers, vectors, colours and placements.

use super::mesh_builder::{Knot, knot};
use super::texture_synth::{Maps, Rgb, rgb};
use glam::{Affine3A, Mat3A, Quat, Vec2, Vec3};
use scene::{AlphaMode, Material};
use std::f32::consts::PI;
use std::iter::Peekable;
use std::ops::Range;
use std::str::{FromStr, SplitWhitespace};

/// The rotation by an angle.
type Rotation<T> = fn(f32) -> T;

/// The words of a row that are not read yet.
pub struct Row {
    place: String,
    words: Peekable<SplitWhitespace<'static>>,
}

impl Row {
    /// The words of a line at a place, without its comment; `None` if there are none.
    pub fn new(line: &'static str, place: impl FnOnce() -> String) -> Option<Self> {
        let content = line.split('#').next().unwrap_or_default();
        let mut words = content.split_whitespace().peekable();
        words.peek()?;
        Some(Self {
            place: place(),
            words,
        })
    }

    /// The next word if it is one of these.
    pub fn one_of(&mut self, words: &[&str]) -> Option<&'static str> {
        self.words.next_if(|word| words.contains(word))
    }

    /// Refuses the row.
    pub fn fail(&mut self, expected: &str) -> ! {
        let rest: Vec<&str> = self.words.by_ref().collect();
        panic!(
            "{}: expected {expected} before '{}'",
            self.place,
            rest.join(" ")
        )
    }

    /// Refuses further words.
    pub fn end(&mut self) {
        if self.words.peek().is_some() {
            self.fail("the end of the row");
        }
    }

    /// The next word.
    pub fn word(&mut self) -> &'static str {
        self.words.next().unwrap_or_else(|| self.fail("a word"))
    }

    /// Refuses the row unless its next word is this one.
    pub fn expect(&mut self, word: &str) {
        if self.word() != word {
            self.fail(word);
        }
    }

    /// The next word as a number.
    pub fn number<T: FromStr>(&mut self) -> T {
        let number = self.word().parse();
        number.unwrap_or_else(|_| self.fail("a number"))
    }

    /// A word as numbers separated by commas.
    pub fn numbers<const N: usize>(&mut self, word: &str) -> [f32; N] {
        let numbers: Result<Vec<f32>, _> = word.split(',').map(str::parse).collect();
        let numbers = numbers.ok().and_then(|numbers| numbers.try_into().ok());
        numbers.unwrap_or_else(|| self.fail(&format!("{N} numbers instead of '{word}'")))
    }

    /// The next word as a vector.
    pub fn vector(&mut self) -> Vec3 {
        let word = self.word();
        self.numbers(word).into()
    }

    /// The next words as vectors.
    pub fn array<const N: usize>(&mut self) -> [Vec3; N] {
        std::array::from_fn(|_| self.vector())
    }

    /// The next words as points of `N` numbers, up to a word of another kind.
    pub fn points<const N: usize>(&mut self) -> impl Iterator<Item = [f32; N]> {
        std::iter::from_fn(move || {
            let word = self.words.next_if(|word| word.contains(','))?;
            Some(self.numbers(word))
        })
    }

    /// The next words as a path of points with radii.
    pub fn path(&mut self) -> Vec<(Vec3, f32)> {
        let points = self.points();
        points
            .map(|[x, y, z, radius]| (Vec3::new(x, y, z), radius))
            .collect()
    }

    /// The next words as an outline.
    pub fn outline(&mut self) -> Vec<Knot> {
        let points = std::iter::from_fn(|| self.words.next_if(|word| word.contains(',')));
        points.map(|point| knot(point, Vec2::ONE)).collect()
    }

    /// The next word as a range `FIRST..END`.
    pub fn range(&mut self) -> Range<u32> {
        let (first, end) = self.word().split_once("..").unwrap_or_default();
        match (first.parse(), end.parse()) {
            (Ok(first), Ok(end)) => first..end,
            _ => self.fail("a range as 0..4"),
        }
    }

    /// The next word as the direction of an axis.
    pub fn axis(&mut self) -> Vec3 {
        match self.word() {
            "x" => Vec3::X,
            "y" => Vec3::Y,
            "z" => Vec3::Z,
            _ => self.fail("x, y or z"),
        }
    }

    /// Rotations about the axis that the next word names, as quaternions and as matrices.
    fn rotation(&mut self) -> (Rotation<Quat>, Rotation<Mat3A>) {
        match self.word() {
            "x" => (Quat::from_rotation_x, Mat3A::from_rotation_x),
            "y" => (Quat::from_rotation_y, Mat3A::from_rotation_y),
            "z" => (Quat::from_rotation_z, Mat3A::from_rotation_z),
            _ => self.fail("x, y or z"),
        }
    }

    /// The next word as an angle in radians, or in multiples of pi.
    pub fn angle(&mut self) -> f32 {
        let word = self.word();
        match word.strip_suffix("pi") {
            Some(halves) => self.numbers::<1>(halves)[0] * PI,
            None => self.numbers::<1>(word)[0],
        }
    }

    /// The next word as a colour.
    pub fn color(&mut self) -> Rgb {
        let code = u32::from_str_radix(self.word(), 16);
        rgb(code.unwrap_or_else(|_| self.fail("a colour")))
    }

    /// The next two words as the colours between which a surface varies.
    pub fn tones(&mut self) -> [Rgb; 2] {
        [self.color(), self.color()]
    }

    /// The next word as the images of a material.
    pub fn maps(&mut self) -> Maps {
        match self.word() {
            "color" => Maps::Color,
            "color-normal" => Maps::ColorNormal,
            "full" => Maps::Full,
            "full-occlusion" => Maps::FullOcclusion,
            _ => self.fail("color, color-normal, full or full-occlusion"),
        }
    }

    /// The function of the name that is the next word.
    pub fn named<F: Copy>(&mut self, functions: &[(&str, F)]) -> F {
        let name = self.word();
        self.function(name, functions)
    }

    /// The function of a name.
    pub fn function<F: Copy>(&mut self, name: &str, functions: &[(&str, F)]) -> F {
        match functions.iter().find(|(known, _)| *known == name) {
            Some((_, function)) => *function,
            None => self.fail(&format!("another word than '{name}'")),
        }
    }

    /// The words up to the row's end as a placement, if there are any.
    pub fn placement(&mut self) -> Option<Affine3A> {
        self.words.peek()?;
        let (mut at, mut scale) = (Vec3::ZERO, Vec3::ONE);
        let (mut turn, mut spin) = (None::<Quat>, None::<Mat3A>);
        while let Some(word) = self.words.next() {
            match word {
                "here" => {}
                "at" => at = self.vector(),
                "scale" => scale = self.vector(),
                "turn" => {
                    let next = self.rotation().0(self.angle());
                    turn = Some(turn.map_or(next, |turn| turn * next));
                }
                "spin" => {
                    let next = self.rotation().1(self.angle());
                    spin = Some(spin.map_or(next, |spin| spin * next));
                }
                _ => self.fail("here, at, scale, turn or spin"),
            }
        }
        let turned = turn.unwrap_or(Quat::IDENTITY);
        let mut place = Affine3A::from_scale_rotation_translation(scale, turned, at);
        if let Some(spin) = spin {
            place.matrix3 = spin;
        }
        Some(place)
    }

    /// Sets what the row says about a material.
    pub fn factors(&mut self, material: &mut Material) {
        while let Some(word) = self.words.next() {
            let (key, value) = word.split_once('=').unwrap_or((word, ""));
            if key == "emissive" {
                material.emissive = self.numbers(value).into();
                continue;
            }
            let [number] = self.numbers::<1>(value);
            match key {
                "roughness" => material.roughness = number,
                "metallic" => material.metallic = number,
                "mirror" => material.mirror = number,
                "transmission" => material.transmission = number,
                "ior" => material.ior = number,
                "mask" => material.alpha = AlphaMode::Mask(number),
                "blend" => {
                    material.alpha = AlphaMode::Blend;
                    material.base_color.w = number;
                }
                "sides" => material.double_sided = number == 2.0,
                _ => self.fail(&format!("a factor instead of '{key}'")),
            }
        }
    }
}
