//! The page of an experiment or a check: headline, then sections of sentences, tables and pictures.

use super::parts::Picture;
use super::{list, shell};
use maud::{Markup, html};

/// An experiment as plain data; what is empty does not appear.
#[derive(Debug, Clone, Default)]
pub struct ExperimentPage {
    /// What it is about.
    pub title: String,
    /// When the page was made, as it shall be written.
    pub date: String,
    /// The result in one to three sentences.
    pub headline: Vec<String>,
    /// What went in: name, value.
    pub inputs: Vec<[String; 2]>,
    /// The sections, from top to bottom.
    pub sections: Vec<Section>,
    /// Name and version of the program.
    pub version: String,
    /// The command line that made the page.
    pub command_line: String,
}

/// One section.
#[derive(Debug, Clone, Default)]
pub struct Section {
    /// Its title.
    pub title: String,
    /// What is said first.
    pub sentences: Vec<String>,
    /// A table; none if it has no rows.
    pub table: Table,
    /// Pictures, one under the other.
    pub pictures: Vec<Picture>,
    /// Small pictures, side by side.
    pub small: Vec<Picture>,
    /// Remarks, a line each.
    pub notes: Vec<String>,
}

/// A table. A first column of names, then numbers.
#[derive(Debug, Clone, Default)]
pub struct Table {
    /// Names of the columns.
    pub head: Vec<String>,
    /// The rows; cells as they shall be written.
    pub rows: Vec<Vec<String>>,
}

impl ExperimentPage {
    /// The whole page.
    pub fn render(&self) -> String {
        let header = html! {
            header {
                div.title { h1 { (self.title) } time { (self.date) } }
                @for (index, sentence) in self.headline.iter().enumerate() {
                    p.headline.more[index > 0] { (sentence) }
                }
                @if !self.inputs.is_empty() {
                    table.inputs { @for [name, value] in &self.inputs { tr { th { (name) } td { (value) } } } }
                }
            }
        };
        let sections: Vec<(String, &str, Markup)> = self
            .sections
            .iter()
            .enumerate()
            .map(|(index, section)| {
                (format!("section-{}", index + 1), section.title.as_str(), section.markup())
            })
            .collect();
        shell(&self.title, &header, &sections, &self.version, &self.command_line)
    }
}

impl Section {
    fn markup(&self) -> Markup {
        html! {
            @for sentence in &self.sentences { p { (sentence) } }
            (self.table.markup())
            @for picture in &self.pictures { (picture.markup()) }
            @if !self.small.is_empty() { div.small { @for picture in &self.small { (picture.markup()) } } }
            (list(&self.notes))
        }
    }
}

impl Table {
    fn markup(&self) -> Markup {
        let numeric = |column: usize| column > 0 && self.rows.iter().all(|row| is_number(row.get(column)));
        let numeric: Vec<bool> = (0..self.head.len()).map(numeric).collect();
        html! {
            @if !self.rows.is_empty() {
                div.scroll {
                    table {
                        thead {
                            tr { @for (name, number) in self.head.iter().zip(&numeric) { th.number[*number] { (name) } } }
                        }
                        tbody {
                            @for row in &self.rows {
                                tr { @for (cell, number) in row.iter().zip(&numeric) { td.number[*number] { (cell) } } }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Whether a cell stands at the right: it begins like a number, or is empty.
fn is_number(cell: Option<&String>) -> bool {
    cell.and_then(|cell| cell.trim_start_matches(['-', '−', '+', '<']).chars().next())
        .is_none_or(|first| first.is_ascii_digit() || first == '–')
}
