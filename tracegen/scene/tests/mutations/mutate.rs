//! Damages files: bytes, pieces, numbers and parts of the JSON.

use serde_json::Value;

/// A seeded generator of numbers.
pub struct Random(formats::random::Random);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(formats::random::Random(
            seed.wrapping_mul(0x9e37_79b9_7f4a_7c15),
        ))
    }

    /// A number below `n`, 0 where n is 0.
    pub fn below(&mut self, n: usize) -> usize {
        self.0.bits().checked_rem(n as u64).unwrap_or(0) as usize
    }

    fn pick<T: Copy>(&mut self, items: &[T]) -> T {
        items[self.below(items.len())]
    }

    /// A random index with the given weights.
    pub fn weighted(&mut self, weights: &[usize]) -> usize {
        let mut at = self.below(weights.iter().sum());
        let hit = weights.iter().position(|&weight| {
            let hit = at < weight;
            at = at.saturating_sub(weight);
            hit
        });
        hit.unwrap_or(0)
    }
}

const NUMBERS: [&str; 22] = [
    "0",
    "1",
    "2",
    "3",
    "4",
    "5",
    "7",
    "-1",
    "255",
    "65535",
    "65536",
    "2147483648",
    "4294967295",
    "4294967296",
    "9007199254740993",
    "18446744073709551615",
    "-9223372036854775808",
    "0.5",
    "1e38",
    "1e39",
    "-1e400",
    "1e-45",
];

const WORDS: [&str; 12] = [
    "nan",
    "\u{1b}[2J",
    "/dev/zero",
    "..",
    "\\",
    "\"",
    "#",
    "f -1 -1 -1\n",
    "null",
    "[[[[",
    "é",
    "data:,",
];

/// A damaged copy, with one to four pieces of damage.
pub fn mutate(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..1 + random.below(4) {
        bytes = match random.below(7) {
            0 => flip(bytes, random),
            1 => splice(bytes, random),
            2 => truncate(bytes, random),
            3 => insert(bytes, random),
            4 => number(bytes, random),
            _ => json(bytes, random),
        };
    }
    bytes
}

fn flip(mut bytes: Vec<u8>, random: &mut Random) -> Vec<u8> {
    let at = random.below(bytes.len());
    if let Some(byte) = bytes.get_mut(at) {
        *byte = match random.below(3) {
            0 => *byte ^ (1 << random.below(8)),
            1 => random.pick(&[0, 0x7f, 0x80, 0xff]),
            _ => random.0.bits() as u8,
        };
    }
    bytes
}

/// Copies a piece over another place or inserts it there.
fn splice(mut bytes: Vec<u8>, random: &mut Random) -> Vec<u8> {
    let from = random.below(bytes.len());
    let piece = bytes[from..].iter().take(1 + random.below(64)).copied();
    let piece: Vec<u8> = piece.collect();
    let at = random.below(bytes.len());
    let replaced = if random.below(2) == 0 { piece.len() } else { 0 };
    let end = (at + replaced).min(bytes.len());
    bytes.splice(at..end, piece);
    bytes
}

fn truncate(mut bytes: Vec<u8>, random: &mut Random) -> Vec<u8> {
    bytes.truncate(random.below(bytes.len() + 1));
    bytes
}

fn insert(mut bytes: Vec<u8>, random: &mut Random) -> Vec<u8> {
    let at = random.below(bytes.len());
    bytes.splice(at..at, random.pick(&WORDS).bytes());
    bytes
}

/// Replaces a number of a text, or four bytes that may be one.
fn number(mut bytes: Vec<u8>, random: &mut Random) -> Vec<u8> {
    let digit = |b: &u8| b.is_ascii_digit() || matches!(b, b'.' | b'-');
    let start = random.below(bytes.len());
    let text = std::str::from_utf8(&bytes).is_ok();
    let Some(first) = bytes[start..].iter().position(digit).filter(|_| text) else {
        let value = random.pick(&[0u32, 1, 0x7fff_ffff, 0x8000_0000, u32::MAX, 0x7fc0_0000]);
        for (byte, new) in bytes[start..].iter_mut().zip(value.to_le_bytes()) {
            *byte = new;
        }
        return bytes;
    };
    let first = start + first;
    let length = bytes[first..].iter().take_while(|b| digit(b)).count();
    bytes.splice(first..first + length, random.pick(&NUMBERS).bytes());
    bytes
}

/// Changes a value in the JSON. Other text gets a byte-level mutation.
fn json(bytes: Vec<u8>, random: &mut Random) -> Vec<u8> {
    let Ok(mut value) = serde_json::from_slice::<Value>(&bytes) else {
        return number(bytes, random);
    };
    let other = pick(&value, random).clone();
    change(&mut value, &other, random);
    value.to_string().into_bytes()
}

/// A random value in the tree.
fn pick<'a>(value: &'a Value, random: &mut Random) -> &'a Value {
    let inner = match value {
        Value::Array(items) if !items.is_empty() => &items[random.below(items.len())],
        Value::Object(map) if !map.is_empty() => {
            map.values().nth(random.below(map.len())).unwrap_or(value)
        }
        _ => return value,
    };
    if random.below(5) == 0 {
        return value;
    }
    pick(inner, random)
}

/// Removes, replaces, repeats or adds something below `value`.
fn change(value: &mut Value, other: &Value, random: &mut Random) {
    let deeper = random.below(6) > 0;
    match value {
        Value::Array(items) if !items.is_empty() => {
            let at = random.below(items.len());
            if deeper {
                return change(&mut items[at], other, random);
            }
            match random.below(4) {
                0 => drop(items.remove(at)),
                1 => items.push(other.clone()),
                2 => items.extend(vec![items[at].clone(); 1 << random.below(10)]),
                _ => items[at] = other.clone(),
            }
        }
        Value::Object(map) if !map.is_empty() => {
            let at = random.below(map.len());
            let key = map.keys().nth(at).cloned().unwrap_or_default();
            if deeper {
                return change(&mut map[key.as_str()], other, random);
            }
            match random.below(3) {
                0 => drop(map.shift_remove(&key)),
                1 => drop(map.insert(key, other.clone())),
                _ => drop(map.insert(random.pick(&WORDS).to_owned(), other.clone())),
            }
        }
        Value::Number(_) if random.below(4) > 0 => {
            *value = serde_json::from_str(random.pick(&NUMBERS)).unwrap_or(Value::Null);
        }
        Value::String(_) if random.below(2) > 0 => *value = random.pick(&WORDS).into(),
        _ => *value = other.clone(),
    }
}
