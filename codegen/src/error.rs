//! Errors of code generation that remain possible with a valid model.

use std::fmt;

use crate::output::Output;

/// Reason why no code was generated.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum GenerateError {
    /// The options choose a frame that the model does not have.
    UnknownFrame {
        /// The name in the options.
        name: String,
    },
    /// The output is one of models with constraints, and the model has none.
    OutputNeedsConstraints {
        /// The output.
        output: Output,
        /// Name of the model.
        model: String,
    },
    /// The output is one of models without constraints, and the model has some.
    OutputLacksConstraints {
        /// The output.
        output: Output,
        /// Name of the model.
        model: String,
    },
    /// The output is one of mechanisms with contacts, in code for their modes.
    OutputNeedsContacts {
        /// The output.
        output: Output,
        /// Name of the model.
        model: String,
    },
    /// The output is a derivative, and the generator was built without them.
    BuiltWithoutDerivatives {
        /// The output.
        output: Output,
    },
    /// Code for modes of contacts is asked for, and the model has no contacts.
    ModesNeedContacts {
        /// Name of the model.
        model: String,
    },
    /// A set of modes has another number of modes than the model has contacts.
    NumberOfModes {
        /// Number of contacts.
        contacts: usize,
        /// Number of modes in the set.
        modes: usize,
    },
    /// All sets of modes are asked for, and they are too many.
    TooManyModes {
        /// Their number; the largest of all numbers where there are more.
        sets: usize,
        /// Largest number.
        most: usize,
    },
    /// Modes of contacts are to be factored, and they cannot be.
    ModesNotFactored {
        /// Name of the model.
        model: String,
    },
    /// Code for modes of contacts is Rust only.
    ModesNeedRust,
    /// Code for contacts with height fields is Rust only.
    TablesNeedRust,
    /// A number in the code is infinite: a freedom has no inertia, which the checks of the model cannot see where
    /// parameters are involved.
    InfiniteNumber {
        /// The output whose code contains it.
        output: Output,
        /// The body whose operation it belongs to; `None` where the code does not say so.
        body: Option<String>,
    },
    /// A result is infinite whatever the state is.
    InfiniteResult {
        /// The output.
        output: Output,
    },
}

impl fmt::Display for GenerateError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let question = "is there a freedom without inertia?";
        match self {
            GenerateError::UnknownFrame { name } => write!(f, "no frame or body is named `{name}`"),
            GenerateError::OutputNeedsConstraints { output, model } => {
                let name = output.name();
                write!(f, "`{name}` is an output of mechanisms with loops or couplings, and `{model}` has none")
            }
            GenerateError::OutputLacksConstraints { output, model } => {
                let name = output.name();
                write!(f, "`{name}` does not know the loops and couplings of `{model}`: use `derivatives`")
            }
            GenerateError::OutputNeedsContacts { output, model } => {
                let name = output.name();
                write!(f, "`{name}` is an output of mechanisms with contacts, of code for their modes (option `modes`), and this is not such code of `{model}`")
            }
            GenerateError::BuiltWithoutDerivatives { output } => {
                let name = output.name();
                write!(f, "`{name}` is not in this program: `mbd-codegen` was built without its feature `derivatives`")
            }
            GenerateError::ModesNeedContacts { model } => {
                write!(f, "code for modes of contacts is asked for, and `{model}` has no contacts")
            }
            GenerateError::NumberOfModes { contacts, modes } => {
                write!(
                    f,
                    "a set of {modes} modes is listed for {contacts} contacts: there is one mode for each contact"
                )
            }
            GenerateError::TooManyModes { sets, most } => {
                let sets = match *sets {
                    usize::MAX => "more sets of modes than can be counted".to_string(),
                    sets => format!("{sets} sets of modes"),
                };
                write!(f, "the contacts have {sets}, and at most {most} get code of their own: list those that a motion visits (`mbd modes --record`)")
            }
            GenerateError::ModesNotFactored { model } => {
                write!(f, "the contacts of `{model}` have too many modes for pieces, which serve limbs that have a few contacts each: list those that a motion visits (`mbd modes --record`)")
            }
            GenerateError::TablesNeedRust => write!(f, "code for contacts with height fields exists in Rust only"),
            GenerateError::ModesNeedRust => {
                write!(f, "code for modes of contacts exists in Rust only")
            }
            GenerateError::InfiniteNumber { output, body: Some(body) } => {
                write!(f, "`{}` contains an infinite number at body `{body}`: {question}", output.name())
            }
            GenerateError::InfiniteNumber { output, body: None } => {
                write!(f, "`{}` contains an infinite number: {question}", output.name())
            }
            GenerateError::InfiniteResult { output } => {
                write!(f, "`{}` has a result that is always infinite: {question}", output.name())
            }
        }
    }
}

impl std::error::Error for GenerateError {}
