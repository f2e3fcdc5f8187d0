//! Motions with contacts against their known answers.

mod known;
mod scene;
