//! Settings of rollouts.

use multibody::codegen::plan::state_layout;
use multibody::runtime::catalogue;
use multibody::runtime::contact::{ImpactOrder, RegimeChoice};
use multibody::runtime::layout::Layout;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::model::Model;

/// The ways to follow contacts: events where they can be resolved and time steps elsewhere, events alone, time steps alone.
const REGIMES: [(&str, RegimeChoice); 3] =
    [("automatic", RegimeChoice::Automatic), ("events", RegimeChoice::Events), ("steps", RegimeChoice::TimeSteps)];

/// How contacts act that collide at the same instant.
const ORDERS: [(&str, ImpactOrder); 2] =
    [("together", ImpactOrder::Simultaneous), ("sequential", ImpactOrder::Sequential)];

/// What a word stands for; all words if it is none of them.
fn named<T: Copy>(all: &[(&'static str, T)], word: &str) -> Result<T, Vec<&'static str>> {
    let found = all.iter().find(|(name, _)| *name == word);
    found.map(|(_, of)| *of).ok_or_else(|| all.iter().map(|(name, _)| *name).collect())
}

/// How motions are computed; a dictionary of Python.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Settings {
    pub dt: f64,
    pub steps: usize,
    pub every: usize,
    pub method: String,
    pub tolerance: Option<f64>,
    pub momenta: bool,
    layout: String,
    contacts: String,
    impacts: String,
    pub threads: Option<usize>,
}

impl Settings {
    /// Refuses what cannot be computed.
    pub fn check(&self) -> PyResult<()> {
        let refuse = |words: String| Err(PyValueError::new_err(words));
        let Some(entry) = catalogue::entry(&self.method) else {
            let names: Vec<&str> = catalogue::entries().map(|entry| entry.name).collect();
            return refuse(format!("no method is called `{}`: take one of {}", self.method, names.join(", ")));
        };
        if !(self.dt > 0.0 && self.dt.is_finite()) {
            return refuse(format!("`dt` is {}: give a step in s, greater than zero", self.dt));
        }
        if !self.steps.is_multiple_of(self.every) || self.every == 0 {
            return refuse(format!("`every` is {}, which does not divide {} steps", self.every, self.steps));
        }
        if self.threads == Some(0) {
            return refuse("`threads` is 0: give at least one, or None for one on each core".into());
        }
        match self.tolerance {
            Some(tolerance) if !(tolerance > 0.0 && tolerance < 1.0) => {
                refuse(format!("`tolerance` is {tolerance}: give a number between 0 and 1"))
            }
            Some(_) if !entry.adaptive => {
                let names: Vec<&str> = catalogue::entries().filter(|e| e.adaptive).map(|e| e.name).collect();
                let (method, names) = (&self.method, names.join(", "));
                refuse(format!("`{method}` has fixed steps: leave `tolerance` out, or take one of {names}"))
            }
            _ => Ok(()),
        }
    }

    /// How contacts are followed: one of [`REGIMES`].
    ///
    /// # Errors
    /// Another word; one for a model without contacts; time steps with a tolerance.
    pub fn regime(&self, touches: bool) -> PyResult<RegimeChoice> {
        let words = match named(&REGIMES, &self.contacts) {
            Err(names) => format!("contacts are not followed by `{}`: take {}", self.contacts, names.join(", ")),
            Ok(choice) if !touches && choice != RegimeChoice::Automatic => {
                format!("the model has no contacts that `{}` could follow", self.contacts)
            }
            Ok(RegimeChoice::TimeSteps) if self.tolerance.is_some() => {
                "time steps have the length `dt`: leave `tolerance` out, or take contacts=\"events\"".into()
            }
            Ok(choice) => return Ok(choice),
        };
        Err(PyValueError::new_err(words))
    }

    /// How contacts act that collide at the same instant: one of [`ORDERS`].
    ///
    /// # Errors
    /// Another word; one where nothing is followed from event to event.
    pub fn impacts(&self, touches: bool) -> PyResult<ImpactOrder> {
        let words = match named(&ORDERS, &self.impacts) {
            Err(names) => format!("contacts do not collide `{}`: take {}", self.impacts, names.join(" or ")),
            Ok(order) if order != ImpactOrder::default() && (!touches || self.contacts == "steps") => {
                let order = &self.impacts;
                format!("`impacts` is `{order}`, but no impacts are looked for: the model has no contacts, or moves by time steps")
            }
            Ok(order) => return Ok(order),
        };
        Err(PyValueError::new_err(words))
    }

    /// The layout of states and joint forces; `None` for that of this project.
    pub fn layout(&self, model: &Model) -> PyResult<Option<Layout>> {
        match &self.layout[..] {
            "mbd" => Ok(None),
            "pinocchio" => Ok(Some(state_layout::pinocchio(&model.plan))),
            "mujoco" => Ok(Some(state_layout::mujoco(&model.plan))),
            other => {
                let words = format!("no layout is called `{other}`: take mbd, pinocchio or mujoco");
                Err(PyValueError::new_err(words))
            }
        }
    }
}
