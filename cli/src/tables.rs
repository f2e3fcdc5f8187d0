//! Tables of numbers as files: CSV, and Parquet with the feature of that name.

use std::fmt::Write as _;
use std::path::Path;

use multibody::codegen::plan::Plan;
use multibody::runtime::contact::RegimeChoice;
use multibody::runtime::integrate::Step;

use super::columns::quoted;
use super::motion::Settings;
use super::{Failure, Outcome};

/// A table of numbers with named columns.
pub struct Table {
    /// Names of the columns.
    pub names: Vec<String>,
    /// The rows, one after the other.
    pub numbers: Vec<f64>,
    /// What the numbers come from, by keys; a CSV file has no place for it.
    #[cfg_attr(not(feature = "parquet"), allow(dead_code))]
    pub about: Vec<(&'static str, String)>,
}

/// Whether the name of a file asks for Parquet.
fn is_parquet(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("parquet"))
}

/// Refuses a name whose format this program was built without, before anything is computed.
pub fn known(path: &Path) -> Outcome {
    if is_parquet(path) && !cfg!(feature = "parquet") {
        return Err(Failure::new(
            format!("cannot write `{}`: this program was built without Parquet", path.display()),
            "build it with `cargo install --path cli --features parquet`, or name a file that ends in .csv",
        ));
    }
    Ok(())
}

/// What a table of a motion says about it: the model, the method, and its tolerance (of rotations, rad) or step, s.
pub fn about(plan: &Plan, settings: &Settings) -> Vec<(&'static str, String)> {
    let stepping = settings.regimes.choice == RegimeChoice::TimeSteps;
    let method = if stepping { "time steps (Moreau's midpoint rule)" } else { settings.method };
    let length = match settings.step {
        _ if stepping => ("step", settings.regimes.step.to_string()),
        Step::Fixed(h) => ("step", h.to_string()),
        Step::Adaptive(tolerances) => ("tolerance", tolerances.rotations.to_string()),
    };
    vec![("model", plan.model.name.clone()), ("method", method.to_string()), length]
}

impl Table {
    /// The contents of a file, in the format that its name asks for.
    pub fn file(&self, path: &Path) -> Outcome<Vec<u8>> {
        known(path)?;
        #[cfg(feature = "parquet")]
        if is_parquet(path) {
            return self.parquet().map_err(|e| {
                Failure::new(format!("cannot write `{}`: {e}", path.display()), "name a file that ends in .csv")
            });
        }
        Ok(self.csv().into_bytes())
    }

    fn csv(&self) -> String {
        let mut text = String::new();
        for (k, name) in self.names.iter().enumerate() {
            text += if k == 0 { "" } else { "," };
            text += &quoted(name);
        }
        text += "\n";
        for row in self.numbers.chunks(self.names.len().max(1)) {
            for (k, x) in row.iter().enumerate() {
                let _ = write!(text, "{}{x}", if k == 0 { "" } else { "," });
            }
            text += "\n";
        }
        text
    }
}

#[cfg(feature = "parquet")]
mod parquet {
    use std::sync::Arc;

    use parquet::basic::{Repetition, Type as Physical};
    use parquet::data_type::DoubleType;
    use parquet::errors::Result;
    use parquet::file::metadata::KeyValue;
    use parquet::file::properties::WriterProperties;
    use parquet::file::writer::SerializedFileWriter;
    use parquet::schema::types::Type;

    use super::Table;

    /// Rows of a group: 8 MiB of each column.
    const GROUP: usize = 1 << 20;

    impl Table {
        /// A column of doubles without missing values for each of the table, plain and not compressed: numbers of a motion
        /// hardly repeat.
        pub(super) fn parquet(&self) -> Result<Vec<u8>> {
            let column = |name: &String| {
                Type::primitive_type_builder(name, Physical::DOUBLE)
                    .with_repetition(Repetition::REQUIRED)
                    .build()
                    .map(Arc::new)
            };
            let fields = self.names.iter().map(column).collect::<Result<Vec<_>>>()?;
            let schema = Type::group_type_builder("motion").with_fields(fields).build()?;
            let about =
                self.about.iter().map(|(key, value)| KeyValue::new((*key).to_string(), value.clone())).collect();
            let properties =
                WriterProperties::builder().set_dictionary_enabled(false).set_key_value_metadata(Some(about)).build();
            let mut writer = SerializedFileWriter::new(Vec::new(), Arc::new(schema), Arc::new(properties))?;
            let width = self.names.len().max(1);
            for rows in self.numbers.chunks(GROUP * width) {
                let mut group = writer.next_row_group()?;
                let mut at = 0;
                while let Some(mut column) = group.next_column()? {
                    let numbers: Vec<f64> = rows.iter().skip(at).step_by(width).copied().collect();
                    column.typed::<DoubleType>().write_batch(&numbers, None, None)?;
                    column.close()?;
                    at += 1;
                }
                group.close()?;
            }
            writer.into_inner()
        }
    }
}
