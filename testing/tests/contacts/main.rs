//! Motions with contacts against their known answers.

mod answers;
mod known;
mod round;
mod scene;
mod stepping;
mod walker;
