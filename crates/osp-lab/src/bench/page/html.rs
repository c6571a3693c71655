use std::fmt::Write;

use crate::{
    bench::{
        charts::{Chart, DataSheet},
        grid::Grid,
    },
    report::push_html,
};

/// A link of the contents.
struct Entry {
    id: String,
    title: String,
    /// Charts of the chapter.
    charts: Vec<(String, String)>,
}

/// The chapters of the page as HTML, with what the contents and the script have to know of them.
#[derive(Default)]
pub(super) struct Html {
    html: String,
    entries: Vec<Entry>,
    pub(super) sheet: DataSheet,
}

impl Html {
    pub(super) fn raw(&mut self, html: &str) {
        self.html.push_str(html);
    }

    /// Text, whatever is in it.
    pub(super) fn text(&mut self, text: &str) {
        push_html(&mut self.html, text);
    }

    pub(super) fn element(&mut self, open: &str, text: &str, close: &str) {
        self.raw(open);
        self.text(text);
        self.raw(close);
    }

    pub(super) fn paragraph(&mut self, text: &str) {
        self.element("<p>", text, "</p>");
    }

    /// A heading with its link to itself.
    pub(super) fn heading(&mut self, level: u8, id: &str, title: &str) {
        // Writing to a string does not fail.
        let _ = write!(self.html, "<h{level} id=\"{id}\">");
        self.text(title);
        self.link_to_self(id);
        let _ = write!(self.html, "</h{level}>");
    }

    fn link_to_self(&mut self, id: &str) {
        let _ = write!(self.html, "<a class=\"self\" href=\"#{id}\" aria-label=\"Link to this place\">#</a>");
    }

    /// A heading within a chapter, which the contents leave out.
    pub(super) fn subheading(&mut self, title: &str) {
        let id = self.id(title);
        self.heading(3, &id, title);
    }

    /// Begins a chapter, which [`Html::end_chapter`] ends.
    pub(super) fn chapter(&mut self, title: &str) {
        let id = self.id(title);
        self.raw("<details class=\"chapter\" open><summary>");
        self.heading(2, &id, title);
        self.raw("</summary>");
        self.entries.push(Entry { id, title: title.to_owned(), charts: Vec::new() });
    }

    pub(super) fn end_chapter(&mut self) {
        self.raw("</details>");
    }

    /// An id that nothing else has: of the title's letters, and a number that counts.
    fn id(&self, title: &str) -> String {
        let mut id = String::new();
        for c in title.chars() {
            match c.is_ascii_alphanumeric() {
                true => id.push(c.to_ascii_lowercase()),
                false if !id.is_empty() && !id.ends_with('-') => id.push('-'),
                false => {}
            }
            if id.len() >= 48 {
                break;
            }
        }
        let number = self.html.matches(" id=\"").count() + 1;
        format!("{}-{number}", id.trim_end_matches('-'))
    }

    /// A table, its best row first where it is known which that is.
    pub(super) fn table(&mut self, about: &str, grid: &Grid) {
        let best = grid.best.and_then(|name| grid.head.iter().position(|head| *head == name));
        self.element("<div class=\"table\" role=\"region\" tabindex=\"0\" aria-label=\"", about, "\">");
        self.raw(if best.is_some() { "<table class=\"best\"><thead><tr>" } else { "<table><thead><tr>" });
        for (at, head) in grid.head.iter().enumerate() {
            let is_more_better = head.ends_with("/s");
            let most = if is_more_better { " data-most" } else { "" };
            let sort = if best == Some(at) { " aria-sort=\"ascending\"" } else { "" };
            self.element(&format!("<th scope=\"col\"{most}{sort}>"), head, "</th>");
        }
        self.raw("</tr></thead><tbody>");
        let mut rows: Vec<&Vec<String>> = grid.rows.iter().collect();
        if let Some(column) = best {
            let value = |row: &Vec<String>| number_of(&row[column]).unwrap_or(f64::INFINITY);
            rows.sort_by(|a, b| value(a).total_cmp(&value(b)));
        }
        for row in rows {
            self.raw("<tr>");
            for cell in row {
                self.element("<td>", cell, "</td>");
            }
            self.raw("</tr>");
        }
        self.raw("</tbody></table></div>");
    }

    /// A chart: the picture, which the script makes one to point at.
    pub(super) fn chart(&mut self, chart: &Chart) -> Result<(), Box<dyn std::error::Error>> {
        if chart.is_empty() {
            return Ok(());
        }
        let id = self.id(&chart.title);
        self.sheet.add(&id, chart);
        let _ = write!(self.html, "<figure id=\"{id}\">");
        self.element("<figcaption><span>", &chart.title, "</span>");
        self.link_to_self(&id);
        self.raw("</figcaption><ul class=\"legend\">");
        for entry in chart.legend() {
            let extra = if entry.is_extra { " class=\"extra\"" } else { "" };
            let dashed = if entry.style.dash().is_some() { " dashed" } else { "" };
            let (color, mark) = (entry.style.css_name(), entry.style.mark_character());
            let _ = write!(
                self.html,
                "<li{extra}><span class=\"sample{dashed}\" style=\"--c:var({color})\" aria-hidden=\"true\">{mark}</span>"
            );
            self.element("", entry.name, "</li>");
        }
        self.raw("</ul><div class=\"drawn\">");
        self.raw(&chart.svg()?);
        self.raw("</div>");
        for remark in &chart.remarks {
            self.element("<p class=\"remark\">", remark, "</p>");
        }
        self.raw("</figure>");
        if let Some(entry) = self.entries.last_mut() {
            entry.charts.push((id, chart.title.clone()));
        }
        Ok(())
    }

    pub(super) fn into_text(self) -> String {
        self.html
    }

    /// Ends the chapters: links to all of them and to their charts, and the chapters themselves.
    pub(super) fn finish(mut self) -> (String, String, DataSheet) {
        let chapters = std::mem::take(&mut self.html);
        let entries = std::mem::take(&mut self.entries);
        let link = |html: &mut Self, id: &str, title: &str| {
            let _ = write!(html.html, "<li><a href=\"#{id}\">");
            html.element("", title, "</a>");
        };
        self.raw("<ul>");
        for Entry { id, title, charts } in &entries {
            link(&mut self, id, title);
            if !charts.is_empty() {
                self.raw("<ul>");
                for (id, title) in charts {
                    link(&mut self, id, title);
                    self.raw("</li>");
                }
                self.raw("</ul>");
            }
            self.raw("</li>");
        }
        self.raw("</ul>");
        (self.html, chapters, self.sheet)
    }
}

/// The number that a cell begins with.
fn number_of(cell: &str) -> Option<f64> {
    let end = cell.find(|c: char| !c.is_ascii_digit() && c != '.' && c != ',').unwrap_or(cell.len());
    cell[..end].replace(',', "").parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_row_comes_first_and_rows_without_a_number_last() {
        let row = |name: &str, cell: &str| vec![name.to_owned(), cell.to_owned()];
        let rows =
            vec![row("a", "1,100 (9..2)"), row("<b>", "-"), row("c", "0.91 (0.9..1.0)"), row("d", "45.0")];
        let mut html = Html::default();
        html.table("t", &Grid::new(vec!["index", "ratio"], rows).least_first("ratio"));
        let text = html.html;
        let places: Vec<usize> = ["<td>c<", "<td>d<", "<td>a<", "<td>&lt;b&gt;<"]
            .iter()
            .map(|cell| text.find(cell).expect("a row"))
            .collect();
        assert!(places.is_sorted(), "{text}");
        assert!(text.contains("<th scope=\"col\" aria-sort=\"ascending\">ratio"), "{text}");
        assert_eq!([number_of("1,234.5 x"), number_of("-"), number_of("NO")], [Some(1234.5), None, None]);
    }

    #[test]
    fn ids_are_of_plain_letters_and_none_comes_twice() {
        let mut html = Html::default();
        html.subheading("a <b> & \"c\".ron");
        html.subheading("a <b> & \"c\".ron");
        let text = html.html;
        assert!(
            text.contains("<h3 id=\"a-b-c-ron-1\">") && text.contains("<h3 id=\"a-b-c-ron-2\">"),
            "{text}"
        );
    }
}
