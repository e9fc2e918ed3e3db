//! The identified parameters and what base parameters are made of.

use crate::number::{ABSENT, significant};
use maud::{Markup, html};

/// Longer tables are folded.
const ROWS_UNFOLDED: usize = 40;
/// Longer expressions are folded.
const CHARACTERS_UNFOLDED: usize = 110;
/// A parameter whose standard deviation is a larger share of its value is greyed.
const POORLY_DETERMINED: f64 = 0.3;

/// The identified parameters.
#[derive(Debug, Clone, Default)]
pub struct ParametersSection {
    /// The parameters in any order; the page sorts them by relative standard deviation.
    pub rows: Vec<ParameterRow>,
    /// What the reader should know about them: how deviations were estimated, `cond`.
    pub note: String,
}

/// One parameter.
#[derive(Debug, Clone, Default)]
pub struct ParameterRow {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its standard deviation; NaN where it is not known.
    pub std: f64,
    /// The unit of both.
    pub unit: String,
}

impl ParameterRow {
    fn relative_std(&self) -> f64 {
        (self.std / self.value).abs()
    }

    fn is_poor(&self) -> bool {
        let relative = self.relative_std();
        relative.is_nan() || relative > POORLY_DETERMINED
    }
}

/// What a base parameter is made of.
#[derive(Debug, Clone, Default)]
pub struct BaseParameter {
    /// Its name.
    pub name: String,
    /// The combination of standard parameters that it stands for, as an expression.
    pub regroups: String,
}

impl ParametersSection {
    pub(super) fn markup(&self) -> Markup {
        if self.rows.is_empty() {
            return html! {};
        }
        let mut rows: Vec<&ParameterRow> = self.rows.iter().collect();
        // Unknown deviations last.
        rows.sort_by(|a, b| a.relative_std().total_cmp(&b.relative_std()));
        let poor = rows.iter().filter(|row| row.is_poor()).count();
        let summary = html! {
            (rows.len()) " parameters, " (rows.len() - poor) " with a standard deviation below "
            (100.0 * POORLY_DETERMINED) " %"
            @if poor > 0 { "; the other " (poor) " are grey" }
            "."
        };
        let table = html! {
            div.columns {
                // Read down one column, then the next.
                @for half in rows.chunks(if rows.len() > 12 { rows.len().div_ceil(2) } else { 12 }) {
                    (parameter_table(half))
                }
            }
        };
        html! {
            @if !self.note.is_empty() { p.note { (self.note) } }
            (folded(rows.len() > ROWS_UNFOLDED, &summary, &table))
        }
    }
}

fn parameter_table(rows: &[&ParameterRow]) -> Markup {
    html! {
        div.scroll { table {
            thead { tr {
                th { "Parameter" } th.number { "Value" } th.number { "Std" } th.number { "Std, %" } th { "Unit" }
            } }
            tbody { @for row in rows { tr.poor[row.is_poor()] {
                td { (row.name) }
                td.number { (significant(row.value, 4)) }
                td.number { (significant(row.std, 2)) }
                td.number { (percent_std(row.relative_std())) }
                td.muted { (row.unit) }
            } } }
        } }
    }
}

fn percent_std(share: f64) -> String {
    match 100.0 * share {
        percent if !percent.is_finite() => ABSENT.into(),
        percent if percent >= 1000.0 => "> 1000".into(),
        percent => significant(percent, 2),
    }
}

pub(super) fn base_markup(groups: &[BaseParameter]) -> Markup {
    if groups.is_empty() {
        return html! {};
    }
    let summary =
        html! { (groups.len()) " base parameters, each with the standard parameters that it regroups." };
    let table = html! {
        div.scroll { table.groups { tbody { @for group in groups { tr {
            th { (group.name) }
            td { (expression(&group.regroups)) }
        } } } } }
    };
    folded(groups.len() > ROWS_UNFOLDED, &summary, &table)
}

/// An expression, a long one showing its beginning until it is opened.
fn expression(text: &str) -> Markup {
    if text.chars().count() <= CHARACTERS_UNFOLDED {
        return html! { code { (text) } };
    }
    // Cut between terms.
    let beginning: String = text.chars().take(CHARACTERS_UNFOLDED - 15).collect();
    let beginning = beginning.rsplit_once(' ').map_or(beginning.as_str(), |(whole, _)| whole);
    html! { details.expression { summary { code { (beginning) " …" } } code { (text) } } }
}

fn folded(fold: bool, summary: &Markup, content: &Markup) -> Markup {
    html! {
        @if fold { details { summary { (summary) } (content) } }
        @else { p.note { (summary) } (content) }
    }
}
