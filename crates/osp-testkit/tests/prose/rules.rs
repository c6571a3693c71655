//! Forms of sentences that a reader has to read twice, and better forms.

use crate::sentences::Sentence;

/// Largest number of words in a sentence.
const MOST_WORDS: usize = 25;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Rule {
    /// Code that seems to speak, hear or wish.
    Personified,
    /// A sentence that begins with a clause in place of a subject, like "What is ...".
    Nominal,
    /// A private word for which the field has a term.
    Private,
    Long,
}

impl Rule {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Rule::Personified => "personified",
            Rule::Nominal => "nominal",
            Rule::Private => "private",
            Rule::Long => "long",
        }
    }
}

/// The rule that a sentence breaks, and the advice.
pub(crate) type Finding = (Rule, String);

/// Words that require a person as subject.
const PERSONIFIED: &[(&[&str], &str)] = &[
    (&["ask", "asks", "asked", "asking"], "query, request, call, pass"),
    (&["hear", "hears", "heard", "hearing"], "receive, get"),
    (&["say", "says", "said", "saying"], "state, contain, print, return"),
    (&["tell", "tells", "told", "telling"], "return, report, distinguish"),
    (&["know", "knows", "knew"], "store, have, depend on"),
    (&["want", "wants", "wanted"], "need, require, select"),
];

/// If one of these is shortly before the word, the subject is a person.
const PERSONS: [&str; 21] = [
    "you",
    "we",
    "who",
    "whoever",
    "somebody",
    "anybody",
    "nobody",
    "everybody",
    "people",
    "person",
    "user",
    "users",
    "author",
    "authors",
    "artist",
    "artists",
    "reader",
    "readers",
    "members",
    "member",
    "viewer",
];

/// Number of words before a form among which the check looks for a subject.
const SUBJECT_WITHIN: usize = 3;

/// Beginnings of a sentence without a subject.
const NOMINAL: &[(&str, &str)] = &[
    ("what", "name the thing: \"Contents of ...\", \"Result of ...\", \"Polygons that ...\""),
    ("who", "name the person or part: \"Author who ...\", \"Thread that ...\""),
    ("whoever", "name the person or part"),
    ("how", "\"Number of ...\", \"Share of ...\", \"Distance that ...\""),
    ("where", "\"Position of ...\"; for a condition \"If ...\", \"In ...\""),
    ("which", "name the things: \"Polygons that ...\""),
    ("that of", "repeat the noun"),
    ("that a", "begin with the subject"),
    ("that the", "begin with the subject"),
    ("that it", "begin with the subject"),
    ("those", "repeat the noun"),
    ("of", "begin with the subject"),
    ("so long", "\"Time for which ...\""),
    ("so many", "\"Number of ...\""),
    ("so much", "\"Amount of ...\""),
    ("so far", "\"Distance to which ...\""),
    ("so often", "\"Number of times ...\""),
];

/// Private words, and the terms that replace them.
const PRIVATE: &[(&str, &str)] = &[
    ("thin out", "remove hidden polygons"),
    ("thins out", "removes hidden polygons"),
    ("thinned", "cleared of hidden polygons"),
    ("thinned out", "cleared of hidden polygons"),
    ("thinning", "removing hidden polygons"),
    ("filed", "inserted"),
    ("anew", "again"),
    ("in vain", "without effect"),
    ("by lot", "at random"),
    ("goes on", "continues"),
    ("go on", "continue"),
    ("is there", "exists, is present"),
    ("at a glance", "first"),
    ("unasked", "without a request"),
    ("vessel", "token bucket"),
    ("stretch", "range"),
    ("stretches", "ranges"),
    ("dearer", "more expensive"),
    ("dear", "expensive"),
    ("dearest", "most expensive"),
    ("takes out", "removes"),
    ("taken out", "removed"),
    ("taking out", "removing"),
    ("looks no further", "stops"),
    ("comes to", "results in"),
    ("come to nothing", "fail"),
];

/// Returns all rules that a sentence breaks, with each form once.
pub(crate) fn findings(sentence: &Sentence) -> Vec<Finding> {
    let words: Vec<String> = sentence.words.iter().map(|word| bare(word)).collect();
    let mut found = Vec::new();
    for (forms, instead) in PERSONIFIED {
        for (place, word) in words.iter().enumerate() {
            let before = &words[place.saturating_sub(SUBJECT_WITHIN)..place];
            let is_of_person = before.iter().any(|word| PERSONS.contains(&word.as_str()));
            if forms.contains(&word.as_str()) && !is_of_person {
                found.push((Rule::Personified, format!("\"{word}\": {instead}")));
            }
        }
    }
    for (form, instead) in NOMINAL {
        let is_question = sentence.words.last().is_some_and(|word| word.ends_with('?'));
        if begins_with(&words, form) && !is_question {
            found.push((Rule::Nominal, format!("\"{form} ...\" at the beginning: {instead}")));
        }
    }
    for (form, instead) in PRIVATE {
        if (0..words.len()).any(|start| begins_with(&words[start..], form)) {
            found.push((Rule::Private, format!("\"{form}\": {instead}")));
        }
    }
    // Numbers and signs do not count, because readers understand them at once.
    let count = sentence.words.iter().filter(|word| word.contains(char::is_alphabetic)).count();
    if count > MOST_WORDS {
        found.push((Rule::Long, format!("{count} words: at most {MOST_WORDS}")));
    }
    found
}

/// Returns a word without marks and in lower case. Empty for code.
fn bare(word: &str) -> String {
    if word.contains('`') {
        return String::new();
    }
    word.trim_matches(|c: char| !c.is_alphanumeric()).to_lowercase()
}

fn begins_with(words: &[String], form: &str) -> bool {
    let mut words = words.iter();
    form.split(' ').all(|part| words.next().is_some_and(|word| word == part))
}
