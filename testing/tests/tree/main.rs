//! Trees without constraints: identities of mechanics, controllers' quantities, derivatives, descriptions that mean the same,
//! reference data.

mod cases;
mod control;
mod coverage;
mod derivatives;
mod equivalence;
mod identities;
mod toml_round_trip;
