//! Trees without constraints: identities of mechanics, quantities for controllers, derivatives, equivalent
//! descriptions.

mod cases;
mod control;
mod coverage;
mod derivatives;
mod equivalence;
mod identities;
mod intervals;
mod long;
mod toml_round_trip;
