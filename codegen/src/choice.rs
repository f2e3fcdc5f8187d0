//! Options that are one of a few words: the macro, manifests and the command line read the same lists.

/// Declares an enum whose values have words. The first value is the default, and the doc comments are the command
/// line's help too.
macro_rules! choice {
    ($(#[doc = $about:literal])+ pub enum $name:ident { $($(#[doc = $meaning:literal])+ $value:ident = $word:literal,)+ }) => {
        $(#[doc = $about])+
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum $name {
            $($(#[doc = $meaning])+ $value,)+
        }

        impl $name {
            /// All values, the default first.
            pub const ALL: [$name; [$($word),+].len()] = [$($name::$value),+];

            /// The word of a value.
            pub fn name(self) -> &'static str {
                match self {
                    $($name::$value => $word,)+
                }
            }

            /// What a value means.
            pub fn meaning(self) -> &'static str {
                match self {
                    $($name::$value => concat!($($meaning),+).trim_matches([' ', '.']),)+
                }
            }

            /// The value of a word.
            pub fn from_name(word: &str) -> Option<$name> {
                $name::ALL.into_iter().find(|choice| choice.name() == word)
            }
        }

        impl Default for $name {
            fn default() -> Self {
                $name::ALL[0]
            }
        }
    };
}

pub(crate) use choice;
