//! A setting of the core by name: how it is read and changed, what it may be, what it means.

use tumble_core::real::{Real, real};
use tumble_core::redundancy::settings::thresholds::Threshold;
use tumble_core::redundancy::settings::{Adoption, Data, FitModel, Gate, Scope};

/// Value of a setting.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A number, or a time in s.
    Number(f64),
    /// One of a few words, or a threshold: `0.1`, `factory+0.1`, `last+0.1` or `last*1.5`.
    Text(String),
    /// Yes or no.
    Flag(bool),
    /// Never, not known, or not limited.
    None,
}

/// Kinds of values that settings take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SettingKind {
    /// A number.
    Number,
    /// A time, s.
    Time,
    /// A whole number.
    Count,
    /// Yes or no.
    Flag,
    /// One of a few words, for the variants of a type of this name.
    Choice(&'static str),
    /// A number above zero, or one that refers to a known error: `0.1`, `factory+0.1`, `last+0.1` or `last*1.5`.
    Threshold,
}

impl SettingKind {
    /// In a word.
    pub fn name(self) -> &'static str {
        match self {
            SettingKind::Number => "number",
            SettingKind::Time => "time",
            SettingKind::Count => "count",
            SettingKind::Flag => "flag",
            SettingKind::Choice(_) => "choice",
            SettingKind::Threshold => "threshold",
        }
    }
}

/// Bound of a setting, by itself and against another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bound {
    /// Anything finite.
    Any,
    /// Zero or above.
    NotNegative,
    /// Above zero.
    Positive,
    /// Above one.
    AboveOne,
    /// From zero up to below one.
    Share,
    /// Longer, or larger, than the other setting, and so above zero.
    MoreThan(&'static str),
}

impl Bound {
    /// Checks that a number is within, other settings aside.
    pub fn admits(self, number: f64) -> bool {
        number.is_finite()
            && match self {
                Bound::Any => true,
                Bound::NotNegative => number >= 0.0,
                Bound::Positive | Bound::MoreThan(_) => number > 0.0,
                Bound::AboveOne => number > 1.0,
                Bound::Share => (0.0..1.0).contains(&number),
            }
    }
}

/// A setting of the settings `S`.
pub struct Setting<S> {
    /// Name in settings files.
    pub name: &'static str,
    /// Where it stands in the core's struct.
    pub path: &'static str,
    /// Group to which it belongs.
    pub group: &'static str,
    /// Empty where it has none.
    pub unit: &'static str,
    /// Bound of the value.
    pub bound: Bound,
    /// One or two sentences.
    pub meaning: &'static str,
    /// Meaning of no value; empty where there always is one.
    pub none: &'static str,
    /// Kind of value it takes.
    pub kind: SettingKind,
    /// The words that may be chosen from; empty where there is no choice.
    pub choices: Vec<&'static str>,
    /// Its value.
    pub get: fn(&S) -> Value,
    /// Sets it, unless it cannot be of such a value.
    pub set: fn(&mut S, &Value) -> Option<()>,
}

/// A value that a setting cannot have.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Unfit {
    /// There is no setting of this name.
    Unknown(String),
    /// It is not of the setting's kind, or beyond what can be kept.
    Kind(&'static str),
    /// It is out of the setting's bounds.
    Bound(&'static str),
}

impl<S> Setting<S> {
    fn change(&self, settings: &mut S, value: &Value) -> Result<(), Unfit> {
        if let Value::Number(number) = value
            && !self.bound.admits(*number)
        {
            return Err(Unfit::Bound(self.name));
        }
        (self.set)(settings, value).ok_or(Unfit::Kind(self.name))
    }
}

/// Defaults with what is stated in their place.
///
/// # Errors
/// [`Unfit`] for the first that cannot be.
pub fn stated<'a, S: Default>(
    table: &[Setting<S>],
    values: impl Iterator<Item = (&'a str, &'a Value)>,
) -> Result<S, Unfit> {
    let mut settings = S::default();
    for (name, value) in values {
        let found = table.iter().find(|setting| setting.name == name);
        let found = found.ok_or_else(|| Unfit::Unknown(name.to_string()))?;
        found.change(&mut settings, value)?;
    }
    Ok(settings)
}

/// One row of a table: `setting!(Settings, group.field, "unit", bound, "Meaning.")`, with `group.field as name` where the
/// path does not end in the name that users write, and `none = "what none means"` where there may be none.
macro_rules! setting {
    ($settings:ty, $($path:ident).+ $(as $name:ident)?, $unit:literal, $bound:expr, $meaning:literal
        $(, none = $none:literal)?) => {{
        let path = concat!($(".", stringify!($path)),+).trim_start_matches('.');
        let given: &[&'static str] = &[$(stringify!($name))?];
        $crate::setting::Setting {
            name: given.first().copied().unwrap_or_else(|| path.rsplit('.').next().unwrap_or(path)),
            path,
            group: "",
            unit: $unit,
            bound: $bound,
            meaning: $meaning,
            none: concat!($($none)?),
            kind: $crate::setting::kind_of(|settings: &$settings| &settings.$($path).+),
            choices: $crate::setting::choices_of(|settings: &$settings| &settings.$($path).+),
            get: |settings: &$settings| $crate::setting::SettingField::get(&settings.$($path).+),
            set: |settings: &mut $settings, value| {
                $crate::setting::SettingField::set(&mut settings.$($path).+, value)
            },
        }
    }};
}
pub(crate) use setting;

/// A field of the core's settings: its type determines the kind of setting.
pub trait SettingField: Sized {
    /// Kind of value it takes.
    const KIND: SettingKind;

    /// The words that may be chosen from; none where there is no choice.
    fn choices() -> Vec<&'static str> {
        Vec::new()
    }

    /// Its value.
    fn get(&self) -> Value;

    /// Converts a value, if it is of the right kind.
    fn read(value: &Value) -> Option<Self>;

    /// Takes a value, if it is of the right kind.
    fn set(&mut self, value: &Value) -> Option<()> {
        *self = Self::read(value)?;
        Some(())
    }
}

pub(crate) fn kind_of<S, F: SettingField>(_: fn(&S) -> &F) -> SettingKind {
    F::KIND
}

pub(crate) fn choices_of<S, F: SettingField>(_: fn(&S) -> &F) -> Vec<&'static str> {
    F::choices()
}

macro_rules! number_field {
    ($number:ty) => {
        impl SettingField for $number {
            const KIND: SettingKind = SettingKind::Number;

            fn get(&self) -> Value {
                Value::Number(wide(*self))
            }

            fn read(value: &Value) -> Option<Self> {
                number(value).map(real)
            }
        }
    };
}

number_field!(f32);
number_field!(f64);

/// A span in microseconds.
impl SettingField for u64 {
    const KIND: SettingKind = SettingKind::Time;

    fn get(&self) -> Value {
        Value::Number(in_seconds(*self))
    }

    fn read(value: &Value) -> Option<Self> {
        in_microseconds(number(value)?)
    }
}

impl SettingField for u32 {
    const KIND: SettingKind = SettingKind::Count;

    fn get(&self) -> Value {
        Value::Number((*self).into())
    }

    fn read(value: &Value) -> Option<Self> {
        whole(number(value)?)
    }
}

impl SettingField for bool {
    const KIND: SettingKind = SettingKind::Flag;

    fn get(&self) -> Value {
        Value::Flag(*self)
    }

    fn read(value: &Value) -> Option<Self> {
        match value {
            Value::Flag(flag) => Some(*flag),
            _ => None,
        }
    }
}

impl<F: SettingField> SettingField for Option<F> {
    const KIND: SettingKind = F::KIND;

    fn get(&self) -> Value {
        self.as_ref().map_or(Value::None, F::get)
    }

    fn read(value: &Value) -> Option<Self> {
        match value {
            Value::None => Some(None),
            value => F::read(value).map(Some),
        }
    }
}

macro_rules! choice_field {
    ($choice:ident) => {
        impl SettingField for $choice {
            const KIND: SettingKind = SettingKind::Choice(stringify!($choice));

            fn choices() -> Vec<&'static str> {
                $choice::NAMES.to_vec()
            }

            fn get(&self) -> Value {
                Value::Text(self.name().to_string())
            }

            fn read(value: &Value) -> Option<Self> {
                let Value::Text(text) = value else {
                    return None;
                };
                $choice::named(text)
            }
        }
    };
}

choice_field!(Adoption);
choice_field!(Data);
choice_field!(Gate);
choice_field!(Scope);
choice_field!(FitModel);

impl<T: Real> SettingField for Threshold<T> {
    const KIND: SettingKind = SettingKind::Threshold;

    fn get(&self) -> Value {
        Value::Text(written(self))
    }

    fn read(value: &Value) -> Option<Self> {
        threshold(value)
    }
}

/// A threshold as users write it.
pub fn threshold<T: Real>(value: &Value) -> Option<Threshold<T>> {
    let text = match value {
        Value::Number(number) => return Some(Threshold::Fixed(real(*number))),
        Value::Text(text) => text.trim(),
        Value::Flag(_) | Value::None => return None,
    };
    let parsed = |text: &str| text.trim().parse::<f64>().ok().map(real);
    let known = ["factory", "last"].into_iter();
    let mut variable = known.filter_map(|error| Some((error, text.strip_prefix(error)?.trim_start())));
    let Some((error, variable)) = variable.next() else {
        return parsed(text).map(Threshold::Fixed);
    };
    match (error, variable.split_at_checked(1)?) {
        ("factory", ("+", margin)) => parsed(margin).map(Threshold::FactoryByMargin),
        ("last", ("+", margin)) => parsed(margin).map(Threshold::VariableByMargin),
        ("last", ("*", ratio)) => parsed(ratio).map(Threshold::VariableByRatio),
        _ => None,
    }
}

fn written<T: Real>(threshold: &Threshold<T>) -> String {
    match *threshold {
        Threshold::Fixed(value) => format!("{}", wide(value)),
        Threshold::FactoryByMargin(margin) => format!("factory+{}", wide(margin)),
        Threshold::VariableByMargin(margin) => format!("last+{}", wide(margin)),
        Threshold::VariableByRatio(ratio) => format!("last*{}", wide(ratio)),
    }
}

/// A number of either precision.
pub fn wide<T: Real>(value: T) -> f64 {
    nalgebra::try_convert(value).unwrap_or(f64::NAN)
}

fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Number(number) => Some(*number),
        Value::Text(_) | Value::Flag(_) | Value::None => None,
    }
}

/// Seconds in a span of microseconds.
#[allow(clippy::cast_precision_loss)]
pub fn in_seconds(microseconds: u64) -> f64 {
    microseconds as f64 / 1e6
}

/// Microseconds in a span of seconds; `None` where it is negative, not finite, or beyond measure.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
pub fn in_microseconds(seconds: f64) -> Option<u64> {
    let microseconds = (seconds * 1e6).round();
    (0.0..1e18).contains(&microseconds).then_some(microseconds as u64)
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn whole(number: f64) -> Option<u32> {
    let fits = number.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&number);
    fits.then_some(number as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thresholds_are_written_as_they_are_meant() {
        for (text, meant) in [
            ("0.1", Threshold::Fixed(0.1)),
            ("last+0.1", Threshold::VariableByMargin(0.1)),
            ("last * 1.5", Threshold::VariableByRatio(1.5)),
            ("factory + 0.1", Threshold::FactoryByMargin(0.1)),
            ("1e+2", Threshold::Fixed(100.0)),
        ] {
            assert_eq!(threshold::<f64>(&Value::Text(text.to_string())), Some(meant));
        }
        for text in ["", "last", "last-0.1", "first+0.1", "0,1", "last+", "factory*2"] {
            assert_eq!(threshold::<f64>(&Value::Text(text.to_string())), None, "{text}");
        }
    }
}
