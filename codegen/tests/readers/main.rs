//! The readers of TOML, URDF and MJCF: the models of valid files, and the findings about others.

mod base;
mod broken;
mod convert;
mod hulls;
mod large;
mod mjcf;
mod mutate;
mod mutation;
mod self_contact;
mod toml_constraints;
mod toml_contacts;
mod toml_reader;
mod toml_variants;
mod urdf_second_opinion;
