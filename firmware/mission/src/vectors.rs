//! Reads what the mission needs of a file of conformance vectors, in place.
//!
//! A reader of our own, as of the JSON readers without a heap none leaves out all panics. It takes for granted what
//! `vectors/generate.py` writes: a key occurs once behind `"cases"`, strings hold no quotation marks, and no number
//! has more than fifteen digits.

use tumble_core::sample::CHANNELS;

use crate::MissionError;

/// The cases of a file.
#[derive(Clone, Copy)]
pub struct Cases<'f>(&'f [u8]);

/// Six channels as an integer of steps each, specific force first.
pub type VectorCounts = [i32; CHANNELS];

impl<'f> Cases<'f> {
    /// Reads the bytes of a file.
    ///
    /// # Errors
    /// [`MissionError::Vectors`] where it has none.
    pub fn of(file: &'f [u8]) -> Result<Self, MissionError> {
        after_key(file, "cases")
            .map(Self)
            .ok_or(MissionError::Vectors("cases"))
    }

    /// A number.
    ///
    /// # Errors
    /// [`MissionError::Vectors`] where there is none of this name.
    pub fn number(&self, name: &'static str) -> Result<f64, MissionError> {
        let number = after_key(self.0, name).and_then(|text| Decimal::read(&mut { text }));
        number.map(Decimal::value).ok_or(MissionError::Vectors(name))
    }

    /// A number of microseconds.
    ///
    /// # Errors
    /// [`MissionError::Vectors`] where there is none of this name.
    pub fn microseconds(&self, name: &'static str) -> Result<u64, MissionError> {
        whole(self.number(name)?).ok_or(MissionError::Vectors(name))
    }

    /// A number of seconds, in microseconds.
    ///
    /// # Errors
    /// [`MissionError::Vectors`] where there is none of this name.
    pub fn seconds(&self, name: &'static str) -> Result<u64, MissionError> {
        whole(self.number(name)? * 1e6).ok_or(MissionError::Vectors(name))
    }

    /// Rows of readings.
    ///
    /// # Errors
    /// [`MissionError::Vectors`] where there are none of this name.
    pub fn rows(&self, name: &'static str) -> Result<VectorRows<'f>, MissionError> {
        let rest = after_key(self.0, name).and_then(|text| after(text, b'['));
        rest.map_or(Err(MissionError::Vectors(name)), |rest| {
            Ok(VectorRows {
                name,
                rest: Some(rest),
            })
        })
    }
}

/// Rows of readings, read one by one. A row that is not a list of six integers is [`MissionError::Vectors`], and the
/// last.
#[derive(Clone)]
pub struct VectorRows<'f> {
    name: &'static str,
    /// Where a row begins, or the list ends.
    rest: Option<&'f [u8]>,
}

impl Iterator for VectorRows<'_> {
    type Item = Result<VectorCounts, MissionError>;

    fn next(&mut self) -> Option<Self::Item> {
        let text = self.rest.take()?;
        if after(text, b']').is_some() {
            return None;
        }
        let Some((counts, behind)) = row(text) else {
            return Some(Err(MissionError::Vectors(self.name)));
        };
        self.rest = after(behind, b',');
        if self.rest.is_none() && after(behind, b']').is_none() {
            return Some(Err(MissionError::Vectors(self.name)));
        }
        Some(Ok(counts))
    }
}

/// The row that text begins with, and what is behind it.
fn row(text: &[u8]) -> Option<(VectorCounts, &[u8])> {
    let mut text = after(text, b'[')?;
    let mut counts = [0; CHANNELS];
    for (i, count) in counts.iter_mut().enumerate() {
        *count = Decimal::read(&mut text)?.integer()?;
        text = after(text, if i + 1 < CHANNELS { b',' } else { b']' })?;
    }
    Some((counts, text))
}

/// A number as it is written: digits, and by which power of ten they are moved.
struct Decimal {
    digits: i64,
    exponent: i32,
}

impl Decimal {
    /// Takes the number that text begins with off it.
    fn read(text: &mut &[u8]) -> Option<Self> {
        let (negative, after_sign) = sign(spaceless(text));
        *text = after_sign;
        let mut digits = 0_i64;
        let (mut found, mut behind_point) = (0, None);
        while let [first, rest @ ..] = *text {
            match first {
                b'0'..=b'9' if found < 18 => {
                    digits = digits * 10 + i64::from(first - b'0');
                    found += 1;
                    behind_point = behind_point.map(|behind: i32| behind + 1);
                }
                b'.' if behind_point.is_none() => behind_point = Some(0),
                _ => break,
            }
            *text = rest;
        }
        let moved = exponent(text)?;
        (found > 0).then_some(Self {
            digits: if negative { -digits } else { digits },
            exponent: moved - behind_point.unwrap_or(0),
        })
    }

    /// Where it is one that fits.
    fn integer(self) -> Option<i32> {
        i32::try_from(self.digits).ok().filter(|_| self.exponent == 0)
    }

    /// Exact to the last bit for up to fifteen digits and powers up to 22: both factors are exact, and are rounded once.
    #[allow(clippy::cast_precision_loss)]
    fn value(self) -> f64 {
        let mut power = 1.0;
        for _ in 0..self.exponent.unsigned_abs().min(22) {
            power *= 10.0;
        }
        let digits = self.digits as f64;
        if self.exponent < 0 {
            digits / power
        } else {
            digits * power
        }
    }
}

/// Takes a power of ten off text, if it begins with one; `None` where there is an `e` but no number.
fn exponent(text: &mut &[u8]) -> Option<i32> {
    let [b'e' | b'E', rest @ ..] = *text else {
        return Some(0);
    };
    let (negative, mut rest) = sign(rest);
    let (mut power, mut found) = (0, false);
    while let [digit @ b'0'..=b'9', behind @ ..] = rest {
        power = (power * 10 + i32::from(digit - b'0')).min(400);
        (rest, found) = (behind, true);
    }
    *text = rest;
    found.then_some(if negative { -power } else { power })
}

/// Strips a minus sign; returns whether there was one, and the text without it.
fn sign(text: &[u8]) -> (bool, &[u8]) {
    match text {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        _ => (false, text),
    }
}

/// Text that follows `"name":`.
fn after_key<'f>(text: &'f [u8], name: &str) -> Option<&'f [u8]> {
    let mut rest = text;
    loop {
        rest = rest.get(rest.iter().position(|byte| *byte == b'"')? + 1..)?;
        let end = rest.iter().position(|byte| *byte == b'"')?;
        let (word, behind) = (rest.get(..end)?, rest.get(end + 1..)?);
        if word == name.as_bytes()
            && let Some(value) = after(behind, b':')
        {
            return Some(value);
        }
        rest = behind;
    }
}

/// Text that follows a byte, if it begins with it.
fn after(text: &[u8], expected: u8) -> Option<&[u8]> {
    match spaceless(text) {
        [first, rest @ ..] if *first == expected => Some(rest),
        _ => None,
    }
}

fn spaceless(mut text: &[u8]) -> &[u8] {
    while let [b' ' | b'\n' | b'\r' | b'\t', rest @ ..] = text {
        text = rest;
    }
    text
}

/// A number that is an integer but for rounding.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn whole(number: f64) -> Option<u64> {
    let nearest = (number + 0.5) as u64;
    (0.0..1e18).contains(&number).then_some(nearest)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &[u8] =
        br#"{"rows": [[9]], "cases": {"tenth_s": 1e-1, "small": 0.0001, "g": -9.80665, "count": 25000,
        "rows": [[1, -2, 3, 4, 5, 6], [ 7,8,9,10,11,-12 ]], "short": [[1, 2]],
        "cut": [[1, 2, 3, 4, 5, 6] [7, 8, 9, 10, 11, 12]], "none": [], "text": "rows", "e": 1e}}"#;

    #[test]
    fn numbers_are_those_that_the_compiler_reads() {
        let cases = Cases::of(FILE).unwrap();
        assert_eq!(cases.number("small"), Ok(0.0001));
        assert_eq!(cases.number("g"), Ok(-9.80665));
        assert_eq!(cases.number("tenth_s"), Ok(0.1));
        assert_eq!(cases.microseconds("count"), Ok(25_000));
        assert_eq!(cases.seconds("tenth_s"), Ok(100_000));
    }

    #[test]
    fn rows_come_one_by_one_and_end_with_their_list() {
        let mut rows = Cases::of(FILE).unwrap().rows("rows").unwrap();
        assert_eq!(rows.next(), Some(Ok([1, -2, 3, 4, 5, 6])));
        assert_eq!(rows.next(), Some(Ok([7, 8, 9, 10, 11, -12])));
        assert_eq!(rows.next(), None);
        assert_eq!(rows.next(), None);
        assert_eq!(Cases::of(FILE).unwrap().rows("none").unwrap().next(), None);
    }

    #[test]
    fn what_is_missing_or_something_else_is_named() {
        let cases = Cases::of(FILE).unwrap();
        assert_eq!(cases.number("nothing"), Err(MissionError::Vectors("nothing")));
        assert_eq!(cases.number("rows"), Err(MissionError::Vectors("rows")));
        assert_eq!(cases.number("e"), Err(MissionError::Vectors("e")));
        assert_eq!(cases.microseconds("g"), Err(MissionError::Vectors("g")));
        assert_eq!(cases.rows("count").err(), Some(MissionError::Vectors("count")));
        for name in ["short", "cut"] {
            let mut rows = cases.rows(name).unwrap();
            assert_eq!(rows.next(), Some(Err(MissionError::Vectors(name))));
            assert_eq!(rows.next(), None);
        }
        assert_eq!(Cases::of(b"{}").err(), Some(MissionError::Vectors("cases")));
    }
}
