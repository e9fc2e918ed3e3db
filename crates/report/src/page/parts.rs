//! What sections of a page are made of.

use crate::plot::Svg;
use maud::{Markup, PreEscaped, html};

/// A picture with what is to be said about it.
#[derive(Debug, Clone)]
pub struct Picture {
    /// A sentence or less; may be empty.
    pub caption: String,
    /// The picture.
    pub svg: Svg,
}

impl Picture {
    pub(super) fn markup(&self) -> Markup {
        html! {
            figure {
                (PreEscaped(self.svg.inline()))
                @if !self.caption.is_empty() { figcaption { (self.caption) } }
            }
        }
    }
}

/// A row of the kind "name, share as a bar, number".
pub(super) fn share_bar(share: f64, scale: f64, before: Option<f64>, noise_floor: Option<f64>) -> Markup {
    let width = |share: f64| format!("{:.1}%", (100.0 * share / scale).clamp(0.0, 100.0));
    let known = |share: Option<f64>| share.filter(|share| share.is_finite());
    html! {
        span.bar {
            @if let Some(before) = known(before) { i.before style={ "width:" (width(before)) } {} }
            @if let Some(share) = known(Some(share)) { i.after style={ "width:" (width(share)) } {} }
            @if let Some(floor) = known(noise_floor) { i.floor style={ "left:" (width(floor)) } {} }
        }
    }
}
