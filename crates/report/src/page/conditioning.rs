//! What was done to the logs before the fit.

use super::parts::Picture;
use maud::{Markup, html};

/// What was done to the logs before the fit.
#[derive(Debug, Clone, Default)]
pub struct ConditioningSection {
    /// Quantity and value, in the order to be shown: `cut-off`, `11.2 Hz, from the torque's spectrum`.
    pub entries: Vec<(String, String)>,
    /// Pictures such as spectra.
    pub pictures: Vec<Picture>,
}

impl ConditioningSection {
    pub(super) fn markup(&self) -> Markup {
        html! {
            @if !self.entries.is_empty() {
                dl { @for (quantity, value) in &self.entries { dt { (quantity) } dd { (value) } } }
            }
            @for picture in &self.pictures { (picture.markup()) }
        }
    }
}
