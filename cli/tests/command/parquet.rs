//! Tables as Parquet.

#[cfg(not(feature = "parquet"))]
use crate::run::bad;
#[cfg(feature = "parquet")]
use crate::run::good;
use crate::run::{folder, run_in, ROOT};

const NAME: &str = "motion.parquet";

fn simulate(folder: &std::path::Path, table: &str) -> std::process::Output {
    let model = format!("{ROOT}/models/double_pendulum.toml");
    run_in(folder, &["simulate", &model, "--time", "1", "--rows", "50", "--tolerance", "1e-8", "--csv", table])
}

/// The same doubles as in the CSV file, and what they come from.
#[cfg(feature = "parquet")]
#[test]
fn a_parquet_file_holds_the_numbers_of_the_csv_file() {
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::RowAccessor;
    let folder = folder("parquet");
    good(simulate(&folder, "motion.csv"));
    good(simulate(&folder, NAME));
    let text = std::fs::read_to_string(folder.join("motion.csv")).expect("a table");
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let names = lines.next().expect("names of columns");
    let reader = SerializedFileReader::new(std::fs::File::open(folder.join(NAME)).expect("a file")).expect("Parquet");
    let about = reader.metadata().file_metadata();
    let columns: Vec<&str> = about.schema_descr().columns().iter().map(|column| column.name()).collect();
    assert_eq!(columns, names);
    let told: Vec<_> = about.key_value_metadata().expect("metadata").iter().collect();
    for (key, value) in [("model", "double_pendulum"), ("method", "verner9"), ("tolerance", "0.00000001")] {
        assert!(told.iter().any(|pair| pair.key == key && pair.value.as_deref() == Some(value)), "{key}: {told:?}");
    }
    let mut count = 0;
    for (row, line) in reader.get_row_iter(None).expect("rows").zip(lines.by_ref()) {
        let row = row.expect("a row");
        for (k, word) in line.iter().enumerate() {
            let expected: f64 = word.parse().expect("a number");
            assert_eq!(row.get_double(k).expect("a double").to_bits(), expected.to_bits(), "{count} {}", names[k]);
        }
        count += 1;
    }
    assert_eq!(count, 51);
    assert!(lines.next().is_none());
}

/// An interrupt leaves a complete file.
#[cfg(all(unix, feature = "parquet"))]
#[test]
fn an_interrupted_run_leaves_a_parquet_file() {
    use parquet::file::reader::{FileReader, SerializedFileReader};
    let folder = folder("parquet_interrupt");
    let model = format!("{ROOT}/models/double_pendulum.toml");
    let arguments = ["simulate", &model, "--time", "1e5", "--every", "0.1", "--csv", NAME];
    let mut child = crate::run::start_in(&folder, &arguments);
    crate::run::wait_until_it_computes(&mut child);
    let kill = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(kill.expect("kill").success());
    assert_eq!(child.wait().expect("an end").code(), Some(130));
    let reader = SerializedFileReader::new(std::fs::File::open(folder.join(NAME)).expect("a file")).expect("Parquet");
    let rows = reader.metadata().file_metadata().num_rows();
    assert!(rows > 10, "{rows}");
}

/// Without the feature the name is refused before anything is computed, and nothing is written.
#[cfg(not(feature = "parquet"))]
#[test]
fn without_the_feature_the_name_is_refused() {
    let folder = folder("parquet_refused");
    bad(simulate(&folder, NAME), &["built without Parquet", "--features parquet"]);
    assert_eq!(std::fs::read_dir(&folder).expect("the directory").count(), 0);
}
