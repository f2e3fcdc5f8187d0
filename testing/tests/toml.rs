//! Random models through the TOML reader and back.

use mbd_codegen::diag::Severity;
use mbd_codegen::import::toml::read;
use mbd_testing::random::{random_model, Knobs};
use mbd_testing::toml::{to_toml_in, Order};

#[test]
fn reader_gives_the_model_that_was_written() {
    for seed in 0..300 {
        let model = random_model(seed, &Knobs::everything(seed, 12));
        for order in [Order::DepthFirst, Order::BreadthFirst] {
            let text = to_toml_in(&model, order);
            let (read, findings) = read("model.toml", &text);
            let errors = findings.0.iter().any(|d| d.severity == Severity::Error);
            assert!(!errors, "seed {seed}: {findings}\n{text}");
            assert_eq!(read.as_ref(), Some(&model), "seed {seed}, {order:?}\n{text}");
        }
    }
}
