//! Tests of the library as users see it: generated types, committed code, shipped models, reference data.

mod base;
mod batch;
mod book;
mod committed;
mod contacts;
mod counts;
mod derivatives;
mod early_contacts;
mod macro_errors;
pub mod macro_model;
mod mechanisms;
mod mjcf;
mod reference;
mod variants;
