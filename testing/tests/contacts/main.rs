//! Motions with contacts against their known answers.

mod answers;
mod boxes;
mod crowds;
mod cylinders;
mod edges;
mod far;
mod fields;
mod hulls;
mod jams;
mod known;
mod models;
mod pendulums;
mod restarts;
mod round;
mod saltation;
mod scene;
mod solid;
mod springs;
mod stepping;
mod stiff;
mod walker;
