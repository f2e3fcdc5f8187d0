//! The readers of TOML and URDF: what valid files mean, and what is said about others.

mod broken;
mod mutate;
mod mutation;
mod toml_constraints;
mod toml_reader;
mod urdf_second_opinion;
