//! The page: headings, sentences, tables and pictures, one after the other.

use std::fmt::Write;

/// A page in the making.
pub struct Page {
    title: String,
    body: String,
}

impl Page {
    /// An empty page.
    pub fn new(title: &str) -> Self {
        Page { title: title.to_owned(), body: String::new() }
    }

    /// A heading.
    pub fn heading(&mut self, text: &str) {
        // Writing to a string does not fail.
        let _ = writeln!(self.body, "<h2>{}</h2>", escaped(text));
    }

    /// A sentence.
    pub fn say(&mut self, text: &str) {
        let _ = writeln!(self.body, "<p>{}</p>", escaped(text));
    }

    /// A table.
    pub fn table<const N: usize>(&mut self, head: &[&str; N], rows: &[[String; N]]) {
        self.body.push_str("<table>\n");
        let line = |cells: &[String], tag: &str| -> String {
            cells.iter().map(|cell| format!("<{tag}>{}</{tag}>", escaped(cell))).collect()
        };
        let _ = writeln!(self.body, "<tr>{}</tr>", line(&head.map(str::to_owned), "th"));
        for row in rows {
            let _ = writeln!(self.body, "<tr>{}</tr>", line(row, "td"));
        }
        self.body.push_str("</table>\n");
    }

    /// A picture with what it shows.
    pub fn picture(&mut self, svg: &str, caption: &str) {
        let _ = writeln!(self.body, "<figure>{svg}<figcaption>{}</figcaption></figure>", escaped(caption));
    }

    /// Small pictures side by side, with what they show.
    pub fn pictures(&mut self, svgs: &[String], caption: &str) {
        let _ = writeln!(
            self.body,
            "<figure class=\"row\"><div>{}</div><figcaption>{}</figcaption></figure>",
            svgs.concat(),
            escaped(caption)
        );
    }

    /// The whole page.
    pub fn render(&self) -> String {
        let title = escaped(&self.title);
        format!(
            "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>{title}</title>\n<style>\
             body{{font:15px/1.5 system-ui,sans-serif;max-width:62rem;margin:2rem auto;padding:0 1rem}}\
             figure{{margin:1rem 0}}figcaption{{color:#555;font-size:90%}}svg{{max-width:100%;height:auto}}\
             .row div{{display:flex;flex-wrap:wrap;gap:.5rem}}.row svg{{max-width:19rem}}\
             table{{border-collapse:collapse;font-size:90%}}th,td{{text-align:left;vertical-align:top;padding:.2rem .8rem .2rem 0;border-bottom:1px solid #ddd}}\
             </style>\n<h1>{title}</h1>\n{}</html>\n",
            self.body
        )
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;")
}
