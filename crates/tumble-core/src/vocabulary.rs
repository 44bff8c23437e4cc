//! Words of enumerations that users meet: in events, logs, files and messages. Each stands once, beside its variant.

/// Defines an enumeration whose variants each have a word, and with it
///
/// * `NAMES`: the words in the order of the variants,
/// * `name()`: the word of one,
/// * where no variant carries figures, `ALL` and `named()`: the variants, and the one of a word.
///
/// An image that asks for no words has none in it.
///
/// ```
/// tumble_core::vocabulary! {
///     /// What a lamp shows.
///     #[derive(Clone, Copy, Debug, PartialEq)]
///     pub enum Lamp {
///         /// Go.
///         Green = "green",
///         /// Stop.
///         RedAndAmber = "red and amber",
///     }
/// }
/// assert_eq!(Lamp::NAMES, ["green", "red and amber"]);
/// assert_eq!(Lamp::RedAndAmber.name(), "red and amber");
/// assert_eq!(Lamp::named("green"), Some(Lamp::Green));
/// ```
#[macro_export]
macro_rules! vocabulary {
    (
        $(#[$meta:meta])*
        $vis:vis enum $name:ident {
            $( $(#[$doc:meta])* $variant:ident = $word:literal ),+ $(,)?
        }
    ) => {
        $(#[$meta])*
        $vis enum $name {
            $( $(#[$doc])* $variant ),+
        }

        impl $name {
            /// All, in their order.
            pub const ALL: &'static [Self] = &[$(Self::$variant),+];

            /// The one of a word.
            pub fn named(word: &str) -> Option<Self> {
                let mut all = Self::ALL.iter().zip(Self::NAMES);
                all.find(|(_, name)| **name == word).map(|(variant, _)| *variant)
            }
        }

        $crate::vocabulary!(@words [$name] [] [$($variant = $word),+]);
    };
    (
        $(#[$meta:meta])*
        $vis:vis enum $name:ident {
            $( $(#[$doc:meta])* $variant:ident $({ $($fields:tt)* })? $(( $($tuple:tt)* ))? = $word:literal ),+ $(,)?
        }
    ) => {
        $(#[$meta])*
        $vis enum $name {
            $( $(#[$doc])* $variant $({ $($fields)* })? $(( $($tuple)* ))? ),+
        }

        $crate::vocabulary!(@words [$name] [] [$($variant = $word),+]);
    };
    (
        $(#[$meta:meta])*
        $vis:vis enum $name:ident<$number:ident: $bound:path> {
            $( $(#[$doc:meta])* $variant:ident $({ $($fields:tt)* })? $(( $($tuple:tt)* ))? = $word:literal ),+ $(,)?
        }
    ) => {
        $(#[$meta])*
        $vis enum $name<$number: $bound> {
            $( $(#[$doc])* $variant $({ $($fields)* })? $(( $($tuple)* ))? ),+
        }

        $crate::vocabulary!(@words [$name<$number>] [<$number: $bound>] [$($variant = $word),+]);
    };
    (@words [$($type:tt)+] [$($generics:tt)*] [$($variant:ident = $word:literal),+]) => {
        impl $($generics)* $($type)+ {
            /// The word of each, in their order.
            pub const NAMES: &'static [&'static str] = &[$($word),+];

            /// Its word.
            pub const fn name(&self) -> &'static str {
                match self {
                    $( Self::$variant { .. } => $word ),+
                }
            }
        }
    };
}
