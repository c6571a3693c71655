//! WGSL's own grammar where it is stricter than naga's: which operators may stand beside each other without parentheses,
//! and which names nobody may use. Browsers' compilers refuse what breaks it. (All of what they check is checked by one of
//! them: `tests/wgsl_strict`.)

use osp_render::SHADERS;

/// <https://www.w3.org/TR/WGSL/#reserved-words>, and what names must not begin with.
const RESERVED: &str = "NULL Self abstract active alignas alignof as asm asm_fragment async attribute auto await become \
    binding_array cast catch class co_await co_return co_yield coherent column_major common compile compile_fragment \
    concept const_cast consteval constexpr constinit crate debugger decltype delete demote demote_to_helper do \
    dynamic_cast enum explicit export extends extern external fallthrough filter final finally friend from fxgroup get \
    goto groupshared highp impl implements import inline instanceof interface layout lowp macro macro_rules match \
    mediump meta mod module move mut mutable namespace new nil noexcept noinline nointerpolation non_coherent noncoherent \
    noperspective null nullptr of operator package packoffset partial pass patch pixelfragment precise precision premerge \
    priv protected pub public readonly ref regardless register reinterpret_cast require resource restrict self set shared \
    sizeof smooth snorm static static_assert static_cast std subroutine super target template this thread_local throw \
    trait try type typedef typeid typename typeof union unless unorm unsafe unsized use using varying virtual volatile \
    wgsl where with writeonly yield";

const OPERATORS: &[&str] = &[
    "<<=", ">>=", "<<", ">>", "<=", ">=", "==", "!=", "&&", "||", "+=", "-=", "*=", "/=", "%=", "&=", "|=",
    "^=", "->", "++", "--",
];

/// A word, a number or an operator, with its line.
type Token<'a> = (&'a str, usize);

fn tokens(source: &str) -> Vec<Token<'_>> {
    let mut tokens = Vec::new();
    for (number, line) in source.lines().enumerate() {
        let mut rest = line.split("//").next().unwrap_or("");
        while let Some(first) = rest.chars().next() {
            let is_word = |c: char| c.is_alphanumeric() || c == '_';
            let length = if is_word(first) {
                // A number goes on after its point.
                let is_part = |c: char| is_word(c) || (first.is_ascii_digit() && c == '.');
                rest.find(|c| !is_part(c)).unwrap_or(rest.len())
            } else {
                let operator = OPERATORS.iter().find(|operator| rest.starts_with(**operator));
                operator.map_or(first.len_utf8(), |operator| operator.len())
            };
            let (token, after) = rest.split_at(length);
            if !first.is_whitespace() {
                tokens.push((token, number + 1));
            }
            rest = after;
        }
    }
    without_templates(tokens)
}

/// `array<vec2<u32>, 4>` becomes `array`: its angles compare nothing. They hold no `;`, `{`, `=`, `&&` or `||` before they
/// close.
fn without_templates(tokens: Vec<Token<'_>>) -> Vec<Token<'_>> {
    let mut kept: Vec<Token<'_>> = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        let follows_a_name =
            kept.last().is_some_and(|(word, _)| word.starts_with(|c: char| c.is_alphabetic()));
        if tokens[at].0 == "<"
            && follows_a_name
            && let Some(end) = end_of_template(&tokens, at)
        {
            at = end;
        } else {
            kept.push(tokens[at]);
            at += 1;
        }
    }
    kept
}

fn end_of_template(tokens: &[Token<'_>], first: usize) -> Option<usize> {
    let (mut angles, mut others) = (0, 0);
    for (at, (token, _)) in tokens.iter().enumerate().skip(first) {
        match *token {
            "(" | "[" => others += 1,
            ")" | "]" if others == 0 => return None,
            ")" | "]" => others -= 1,
            ";" | "{" | "=" | ":" | "&&" | "||" => return None,
            "<" if others == 0 => angles += 1,
            ">" if others == 0 => angles -= 1,
            ">>" if others == 0 => angles -= 2,
            _ => {}
        }
        if angles <= 0 {
            return Some(at + 1);
        }
    }
    None
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Arithmetic,
    Shift,
    Compare,
    /// `&`, `|` or `^`.
    Bits(char),
    /// `&&` or `||`.
    Logic(char),
}

fn kind_of(token: &str) -> Option<Kind> {
    Some(match token {
        "+" | "-" | "*" | "/" | "%" => Kind::Arithmetic,
        "<<" | ">>" => Kind::Shift,
        "<" | ">" | "<=" | ">=" | "==" | "!=" => Kind::Compare,
        "&" | "|" | "^" => Kind::Bits(token.chars().next()?),
        "&&" | "||" => Kind::Logic(token.chars().next()?),
        _ => return None,
    })
}

/// What is wrong with the binary operators of one expression, in order, those in parentheses left out.
fn wrong_with(operators: &[Kind]) -> Option<&'static str> {
    let logic: Vec<&Kind> = operators.iter().filter(|kind| matches!(kind, Kind::Logic(_))).collect();
    if logic.windows(2).any(|pair| pair[0] != pair[1]) {
        return Some("&& beside ||");
    }
    let bits = operators.iter().find(|kind| matches!(kind, Kind::Bits(_)));
    if bits.is_some_and(|bits| operators.iter().any(|kind| kind != bits)) {
        return Some("&, | or ^ beside another operator");
    }
    for part in operators.split(|kind| matches!(kind, Kind::Logic(_))) {
        if part.iter().filter(|kind| **kind == Kind::Compare).count() > 1 {
            return Some("one comparison beside another");
        }
        for side in part.split(|kind| *kind == Kind::Compare) {
            if side.contains(&Kind::Shift) && side.len() > 1 {
                return Some("a shift beside another operator");
            }
        }
    }
    None
}

/// The faults of a shader: line and what is wrong.
fn faults(source: &str) -> Vec<(usize, String)> {
    let mut faults = Vec::new();
    // Of each open bracket the binary operators of the expression at hand.
    let mut open: Vec<Vec<Kind>> = vec![Vec::new()];
    // Whether an operator that comes now has something to its left.
    let mut has_left = false;
    for (token, line) in tokens(source) {
        let is_word = token.starts_with(|c: char| c.is_alphanumeric() || c == '_');
        let is_number = token.starts_with(|c: char| c.is_ascii_digit());
        if is_word && !is_number {
            let is_reserved = RESERVED.split_whitespace().any(|word| word == token);
            if is_reserved || token.starts_with("__") || token == "_" {
                faults.push((line, format!("`{token}` is reserved")));
            }
        }
        let mut end = |operators: &mut Vec<Kind>| {
            if let Some(wrong) = wrong_with(operators) {
                faults.push((line, wrong.to_owned()));
            }
            operators.clear();
        };
        let last = open.last_mut().expect("the outermost");
        match token {
            "(" | "[" => {
                open.push(Vec::new());
                has_left = false;
            }
            ")" | "]" => {
                end(last);
                open.pop();
                assert!(!open.is_empty(), "line {line}: brackets do not match");
                has_left = true;
            }
            _ if is_word => {
                has_left = !matches!(token, "return" | "if" | "while" | "switch" | "case" | "else");
                if !has_left {
                    end(last);
                }
            }
            _ => {
                match kind_of(token) {
                    Some(kind) if has_left => last.push(kind),
                    // A sign, a pointer, an address.
                    Some(_) => {}
                    None if matches!(token, "." | "!" | "~" | "@") => {}
                    None => end(last),
                }
                has_left = token == "." && has_left;
            }
        }
    }
    faults
}

#[test]
fn every_shader_keeps_to_the_grammar() {
    for (name, source) in SHADERS {
        let faults = faults(source);
        assert!(faults.is_empty(), "{name}.wgsl: {faults:?}");
    }
}

#[test]
fn what_browsers_refuse_is_found() {
    for wrong in [
        "let a = (mask >> bit & 1u) == 1u;",
        "let a = b + c << 2u;",
        "let a = b << c + 2u;",
        "let a = b << 1u << 2u;",
        "if a & b == c { return; }",
        "let a = b & c | d;",
        "let a = b ^ c ^ d & e;",
        "let a = b + c & d;",
        "let a = b && c || d;",
        "let a = f(b | c && d);",
        "let a = b < c == d;",
        "let a = vec2<u32>(x >> 1u & 3u, 2u);",
        "let a = b[i >> 1u + 2u];",
        "return x >> 1u & 3u;",
        "let from = 1u;",
        "let __a = 1u;",
    ] {
        assert_eq!(faults(wrong).len(), 1, "{wrong}: {:?}", faults(wrong));
    }
}

#[test]
fn what_is_right_is_not_refused() {
    for right in [
        "let a = ((mask >> bit) & 1u) == 1u;",
        "let a = b + (c << 2u);",
        "let a = b << 2u;",
        "if (a & b) == c && d < e - 1 * f { return; }",
        "let a = b & c & d;",
        "let a = (b && c) || d;",
        "let a = b == c || d >= -e || !f;",
        "let a = f(x >> 1u, y & 3u, -z, *p, &q);",
        "var<storage, read_write> a: array<vec2<u32>, 4>;",
        "for (var i = 0u; i < 8u; i++) { a[i] = b[i - 1u] >> 2u; }",
        "let a = array<u32, 2>(1u, 2u)[i & 1u];",
        "let a = b < c; // a > b & c == d",
        "@group(0) @binding(1) var<uniform> a: B;",
        "x &= x - 1u;",
        "let a = 1.0e-5 + 2.0;",
        "let a = (0x320210u >> (4u * (index % 6u))) & 3u;",
    ] {
        assert_eq!(faults(right), [], "{right}");
    }
}
