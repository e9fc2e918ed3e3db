//! The page: headings, sentences and pictures, in the order in which they were measured.

use std::fmt::Write;

/// A page in the making; what is said is printed, too.
#[derive(Default)]
pub struct Page(String);

impl Page {
    /// A heading.
    pub fn heading(&mut self, text: &str) {
        println!("\n{text}");
        // Writing to a string does not fail.
        let _ = writeln!(self.0, "<h2>{}</h2>", escaped(text));
    }

    /// A sentence.
    pub fn say(&mut self, text: &str) {
        println!("{text}");
        let _ = writeln!(self.0, "<p>{}</p>", escaped(text));
    }

    /// A picture with what it shows.
    pub fn picture(&mut self, svg: &str, caption: &str) {
        let _ = writeln!(self.0, "<figure>{svg}<figcaption>{}</figcaption></figure>", escaped(caption));
    }

    /// The whole page.
    pub fn render(&self) -> String {
        format!(
            "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>Retargeting</title>\n<style>\
             body{{font:15px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem}}\
             figure{{margin:1rem 0}}figcaption{{color:#555;font-size:90%}}svg{{max-width:100%;height:auto}}\
             </style>\n<h1>Retargeting</h1>\n{}</html>\n",
            self.0
        )
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;")
}
