use std::collections::{BTreeSet, HashSet};

use super::{Author, Event, GroupId};

/// The authors who have joined a session, and the groups that exist. They decide whether an author may cause an event.
/// Readers and the [`Reducer`](super::Reducer) use this type.
#[derive(Clone, Debug, Default)]
pub(super) struct Members {
    /// The number of the last author who joined; 0 before the first author.
    last: u32,
    present: BTreeSet<Author>,
    /// The existing groups. Their number is limited, because readers limit the number of groupings.
    groups: HashSet<GroupId>,
}

/// The change that one event makes to the members.
#[derive(Clone, Copy, Debug)]
pub(super) enum Admitted {
    Nothing,
    Joined { author: Author, last: u32 },
    Left(Author),
    Made(GroupId),
}

/// Whether numbers of authors may be missing, because the lines of their joins were damaged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum AuthorNumbers {
    Consecutive,
    WithGaps,
}

impl Members {
    /// The number of the next author to join; `None` if the session has the largest number of authors.
    pub(super) fn next(&self) -> Option<Author> {
        Some(Author(self.last + 1)).filter(|next| next.is_valid())
    }

    pub(super) fn is_present(&self, author: Author) -> bool {
        self.present.contains(&author)
    }

    /// Processes the next event of a session. If its author may not cause it, returns the expected form as text.
    /// Otherwise updates the members; [`Members::take_back`] reverts the update.
    pub(super) fn admit(&mut self, event: &Event, numbers: AuthorNumbers) -> Result<Admitted, String> {
        let author = match event {
            Event::Join { author, .. } => return self.join(*author, numbers),
            _ => event.author(),
        };
        let Some(author) = author else { return Ok(Admitted::Nothing) };
        if !author.is_sole() && !self.is_present(author) {
            let expected = if author.0 <= self.last {
                format!("an author who is present: author {author} has left, or has never joined")
            } else {
                format!("author {author} to have joined before")
            };
            return Err(expected);
        }
        match event {
            Event::Leave { .. } => {
                self.present.remove(&author);
                return Ok(Admitted::Left(author));
            }
            Event::Begin { stroke, .. } | Event::Polygon { stroke: Some(stroke), .. }
                if stroke.author() != author =>
            {
                return Err(format!("a stroke of author {author}: {}", author.range()));
            }
            Event::Group { group, .. } => {
                if group.author() != author && !self.groups.contains(group) {
                    let range = author.range();
                    return Err(format!("a group that was made before, or one of author {author}: {range}"));
                }
                if self.groups.insert(*group) {
                    return Ok(Admitted::Made(*group));
                }
            }
            _ => {}
        }
        Ok(Admitted::Nothing)
    }

    /// Reverts an event's change. Later changes must be reverted first.
    pub(super) fn take_back(&mut self, admitted: Admitted) {
        match admitted {
            Admitted::Nothing => {}
            Admitted::Joined { author, last } => {
                self.present.remove(&author);
                self.last = last;
            }
            Admitted::Left(author) => _ = self.present.insert(author),
            Admitted::Made(group) => _ = self.groups.remove(&group),
        }
    }

    fn join(&mut self, author: Author, numbers: AuthorNumbers) -> Result<Admitted, String> {
        let next = self.last + 1;
        let is_next = author.0 == next || (author.0 > next && numbers == AuthorNumbers::WithGaps);
        if !is_next {
            return Err(format!(
                "author {next} to join: authors are numbered in the order in which they join, and a number is not used again"
            ));
        }
        let last = std::mem::replace(&mut self.last, author.0);
        self.present.insert(author);
        Ok(Admitted::Joined { author, last })
    }
}
