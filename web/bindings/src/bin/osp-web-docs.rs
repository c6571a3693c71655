//! `osp-web-docs DOCS FOLDER` writes every page of the documentation as HTML into a folder, with the pictures beside them.

use std::{
    ffi::OsStr,
    fs,
    path::{Path, PathBuf},
};

use anyhow::Context;
use pulldown_cmark::{CowStr, Event, HeadingLevel, Options, Parser, Tag, TagEnd, html};

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args_os().skip(1).map(PathBuf::from);
    let (docs, folder) = arguments
        .next()
        .zip(arguments.next())
        .context("expected the folder of the docs and another folder")?;
    fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    for entry in fs::read_dir(&docs).with_context(|| docs.display().to_string())? {
        let path = entry?.path();
        let to = |ending: &str| folder.join(path.with_extension(ending).file_name().unwrap_or_default());
        match path.extension().and_then(OsStr::to_str) {
            Some("md") => {
                let text = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
                fs::write(to("html"), page(&text))?;
            }
            Some(ending @ ("gif" | "png")) => {
                fs::copy(&path, to(ending))?;
            }
            _ => {}
        }
    }
    Ok(())
}

/// A page of the documentation as a whole HTML document.
fn page(text: &str) -> String {
    let mut events = Vec::new();
    let (mut title, mut is_title) = (String::new(), false);
    // Headings have the anchors to which links of other pages lead.
    let mut heading: Option<(usize, String)> = None;
    // A link to a file that is not on the page is only its text.
    let mut is_dropped = false;
    for event in Parser::new_ext(text, Options::ENABLE_TABLES) {
        match event {
            Event::Start(Tag::Link { dest_url, link_type, title, id }) => {
                match on_page(&dest_url) {
                    Some(dest_url) => events.push(Event::Start(Tag::Link { dest_url, link_type, title, id })),
                    None => is_dropped = true,
                }
                continue;
            }
            Event::End(TagEnd::Link) if std::mem::take(&mut is_dropped) => continue,
            Event::Start(Tag::Heading { level, .. }) => {
                is_title = level == HeadingLevel::H1;
                heading = Some((events.len(), String::new()));
            }
            Event::End(TagEnd::Heading(_)) => {
                if let Some((start, name)) = heading.take()
                    && let Some(Event::Start(Tag::Heading { id, .. })) = events.get_mut(start)
                {
                    *id = Some(anchor(&name).into());
                }
                is_title = false;
            }
            Event::Text(ref words) | Event::Code(ref words) => {
                if let Some((_, name)) = &mut heading {
                    name.push_str(words);
                }
                if is_title {
                    title.push_str(words);
                }
            }
            _ => {}
        }
        events.push(event);
    }
    let mut body = String::new();
    html::push_html(&mut body, events.into_iter());
    let mut escaped = String::new();
    html::push_html(&mut escaped, std::iter::once(Event::Text(title.into())));
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{escaped} - osp</title>\n\
         <link rel=\"icon\" href=\"data:,\">\n<link rel=\"stylesheet\" href=\"../docs.css\">\n\
         <nav><a href=\"../index.html\">The window</a> <a href=\"../race.html\">The race</a> \
         <a href=\"osp-tree.html\">What an OSP tree is</a></nav>\n<main>\n{body}</main>\n"
    )
}

/// The address of a link on the page; `None` for files outside the documentation.
fn on_page(address: &str) -> Option<CowStr<'static>> {
    if address.starts_with("http") || address.starts_with('#') {
        return Some(address.to_owned().into());
    }
    let (file, anchor) =
        address.split_once('#').map_or((address, None), |(file, anchor)| (file, Some(anchor)));
    let path = Path::new(file);
    if path.components().count() != 1 || path.extension() != Some(OsStr::new("md")) {
        return None;
    }
    let html = path.with_extension("html").display().to_string();
    Some(anchor.map_or(html.clone(), |anchor| format!("{html}#{anchor}")).into())
}

/// The anchor of a heading, as hosts of repositories make it.
fn anchor(name: &str) -> String {
    let letter = |c: char| match c {
        ' ' => Some('-'),
        c if c.is_alphanumeric() || c == '-' || c == '_' => Some(c.to_ascii_lowercase()),
        _ => None,
    };
    name.trim().chars().filter_map(letter).collect()
}
