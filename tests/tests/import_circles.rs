//! No import circles: within a crate, two folders or files that lie beside each other never import from each other, directly
//! or by way of a third. So each can be read, tested and replaced with only those below it in mind.
//!
//! The check reads source text: paths that begin with `crate`, `super`, `self` or a module declared in the same file. A
//! `pub use` only passes a name on, so its file depends on nothing by it. Test modules may import what they like.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use cargo_metadata::MetadataCommand;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use stepvalve_tests::repository;

/// A module's path within its crate; empty for the root.
type Module = Vec<String>;

/// What the check needs to know of a module's file.
#[derive(Default)]
struct Source {
    /// Paths that it names.
    paths: Vec<Vec<String>>,
    /// Names that it imports or passes on, with their paths.
    names: BTreeMap<String, Vec<String>>,
}

/// The tokens that paths are made of: words, `::`, and single characters.
fn tokens(text: &str) -> Vec<&str> {
    let mut found = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let word = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
        let length = match first {
            _ if word > 0 => word,
            ':' if rest.starts_with("::") => 2,
            _ => first.len_utf8(),
        };
        let (token, after) = rest.split_at(length);
        if !first.is_whitespace() {
            found.push(token);
        }
        rest = after;
    }
    found
}

/// All paths of a tree such as `a::{b, c::{self, d as e}}`, each with the name that it brings; where the tree ends.
fn tree(tokens: &[&str], mut at: usize, prefix: &[&str], found: &mut Vec<(Vec<String>, String)>) -> usize {
    let mut path = prefix.to_vec();
    loop {
        match tokens.get(at) {
            Some(&"{") => {
                at += 1;
                while tokens.get(at).is_some_and(|token| *token != "}") {
                    at = tree(tokens, at, &path, found);
                    at += usize::from(tokens.get(at) == Some(&","));
                }
                return at + 1;
            }
            Some(word) => path.push(word),
            None => return at,
        }
        at += 1;
        if tokens.get(at) != Some(&"::") {
            break;
        }
        at += 1;
    }
    if path.len() > 1 && path.last() == Some(&"self") {
        path.pop();
    }
    let renamed = tokens.get(at) == Some(&"as");
    let name = if renamed { tokens[at + 1] } else { path[path.len() - 1] };
    found.push((path.iter().map(|&word| word.to_owned()).collect(), name.to_owned()));
    if renamed { at + 2 } else { at }
}

/// Reads a file's text; `children` are the modules that it declares.
fn source(text: &str, children: &BTreeSet<String>) -> Source {
    let code: Vec<&str> = text.lines().map(|line| line.split("//").next().unwrap_or("")).collect();
    let code = code.join("\n");
    let code = code.split("#[cfg(test)]\n#[allow").next().unwrap();
    let code = code.split("#[cfg(test)]\nmod tests {").next().unwrap();
    let tokens = tokens(code);
    let mut source = Source::default();
    let (mut at, mut statement) = (0, 0);
    while at < tokens.len() {
        let is_use = tokens[at] == "use";
        let starts = ["crate", "super", "self"].contains(&tokens[at]) || children.contains(tokens[at]);
        let is_path = starts && tokens.get(at + 1) == Some(&"::") && (at == 0 || tokens[at - 1] != "::");
        if matches!(tokens[at], ";" | "}" | "]") {
            statement = at + 1;
        }
        if !is_use && !is_path {
            at += 1;
            continue;
        }
        let passes_on = is_use && tokens.get(statement) == Some(&"pub");
        let mut found = Vec::new();
        at = tree(&tokens, at + usize::from(is_use), &[], &mut found);
        for (path, name) in found {
            let ours = ["crate", "super", "self"].contains(&path[0].as_str()) || children.contains(&path[0]);
            if ours && is_use {
                source.names.insert(name, path.clone());
            }
            if ours && !passes_on {
                source.paths.push(path);
            }
        }
    }
    source
}

/// The module in whose file a path of `from` ends, names that are passed on followed.
fn resolve(
    sources: &BTreeMap<Module, Source>,
    from: &Module,
    path: &[String],
    depth: usize,
) -> Option<Module> {
    let mut at = from.clone();
    for (index, word) in path.iter().enumerate() {
        match word.as_str() {
            "crate" => at.clear(),
            "self" => {}
            "super" => drop(at.pop()?),
            _ => {
                let child = [&at[..], std::slice::from_ref(word)].concat();
                if sources.contains_key(&child) {
                    at = child;
                    continue;
                }
                let passed_on = sources.get(&at)?.names.get(word).filter(|_| index > 0 && depth < 9);
                return passed_on.map_or(Some(at.clone()), |path| resolve(sources, &at, path, depth + 1));
            }
        }
    }
    Some(at)
}

/// The first circle among the children of a module, with the imports that make it.
fn circle_below(sources: &BTreeMap<Module, Source>, module: &Module) -> Option<Vec<(String, String)>> {
    let within = |of: &Module| of.starts_with(module);
    let child = |of: &Module| of.get(module.len()).cloned();
    let mut edges: BTreeMap<String, BTreeMap<String, String>> = BTreeMap::new();
    for (from, source) in sources.iter().filter(|(from, _)| within(from)) {
        let ends = source.paths.iter().filter_map(|path| resolve(sources, from, path, 0));
        for to in ends.filter(within) {
            let (Some(one), Some(other)) = (child(from), child(&to)) else { continue };
            if one != other {
                let import = format!("{} imports from {}", from.join("::"), to.join("::"));
                edges.entry(one).or_default().insert(other, import);
            }
        }
    }
    edges.keys().find_map(|first| {
        let mut ways = vec![(first.clone(), Vec::new())];
        let mut seen = BTreeSet::new();
        while let Some((at, way)) = ways.pop() {
            for (to, import) in edges.get(&at).into_iter().flatten() {
                let way = [&way[..], &[(at.clone(), import.clone())]].concat();
                if to == first {
                    return Some(way);
                }
                if seen.insert(to.clone()) {
                    ways.insert(0, (to.clone(), way));
                }
            }
        }
        None
    })
}

/// Circles of a crate whose files have these texts, by the module that they lie below.
fn circles(files: &BTreeMap<Module, String>) -> Vec<(String, Vec<(String, String)>)> {
    let children = |of: &Module| -> BTreeSet<String> {
        let below = files.keys().filter(|module| module.len() == of.len() + 1 && module.starts_with(of));
        below.filter_map(|module| module.last().cloned()).collect()
    };
    let sources: BTreeMap<Module, Source> =
        files.iter().map(|(module, text)| (module.clone(), source(text, &children(module)))).collect();
    let found =
        sources.keys().filter_map(|module| Some((module.join("::"), circle_below(&sources, module)?)));
    found.collect()
}

/// The texts of a crate's files by module; programs of their own (src/bin) are none.
fn read(folder: &Path, module: &Module, files: &mut BTreeMap<Module, String>) {
    for entry in std::fs::read_dir(folder).unwrap().flatten() {
        let path = entry.path();
        let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
        let child = [&module[..], std::slice::from_ref(&name)].concat();
        if path.is_dir() && name != "bin" {
            read(&path, &child, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let own = ["lib", "main", "mod"].contains(&name.as_str());
            let text = std::fs::read_to_string(&path).unwrap();
            files.entry(if own { module.clone() } else { child }).or_default().push_str(&text);
        }
    }
}

#[test]
fn no_crate_has_an_import_circle() {
    let metadata =
        MetadataCommand::new().manifest_path(repository().join("Cargo.toml")).no_deps().exec().unwrap();
    let mut found = Vec::new();
    for package in metadata.workspace_packages() {
        let mut files = BTreeMap::new();
        read(package.manifest_path.parent().unwrap().join("src").as_std_path(), &Vec::new(), &mut files);
        assert!(!files.is_empty(), "{} has no sources", package.name);
        for (module, circle) in circles(&files) {
            let way: Vec<&str> = circle.iter().map(|(_, import)| import.as_str()).collect();
            found.push(format!("{}, in {module:?}: {}", package.name, way.join("; ")));
        }
    }
    assert!(found.is_empty(), "import circles:\n{}", found.join("\n"));
}

/// Files of a crate, by name and text.
type Files<'a> = &'a [(&'a str, &'a str)];

/// A crate made of file names (`a/b` is the module `a::b`) and texts.
fn crate_of(files: Files<'_>) -> BTreeMap<Module, String> {
    let module = |name: &str| name.split('/').filter(|part| !part.is_empty()).map(str::to_owned).collect();
    files.iter().map(|(name, text)| (module(name), (*text).to_owned())).collect()
}

#[test]
fn circles_are_found_between_files_between_folders_and_through_names_passed_on() {
    let ways: [(Files, &[&str]); 8] = [
        (&[("", "mod a; mod b;"), ("a", "use crate::b::B;"), ("b", "struct B;")], &[]),
        (&[("", "mod a; mod b;"), ("a", "use crate::b::B;"), ("b", "fn f() { super::a::f() }")], &[""]),
        (
            &[("", ""), ("a", "use crate::{b::B, c::{self, C as D}};"), ("b", ""), ("c", "use crate::a::A;")],
            &[""],
        ),
        // Two folders, no two files.
        (
            &[
                ("", ""),
                ("a", ""),
                ("a/x", "use crate::b::y::Y;"),
                ("a/z", ""),
                ("b", ""),
                ("b/y", ""),
                ("b/w", "use crate::a::z::Z;"),
            ],
            &[""],
        ),
        // A name that the folder passes on is the file's that has it.
        (
            &[
                ("", ""),
                ("a", "mod x; mod y; pub use x::X;"),
                ("a/x", "pub struct X;"),
                ("a/y", "use super::X;"),
            ],
            &[],
        ),
        (
            &[
                ("", ""),
                ("a", "mod x; mod y; pub use x::X;"),
                ("a/x", "use super::y::Y; pub struct X;"),
                ("a/y", "use super::X;"),
            ],
            &["a"],
        ),
        // A folder's own file has what its files share, and calls them.
        (&[("", ""), ("a", "mod x; pub struct A; fn f() { x::g() }"), ("a/x", "use super::A;")], &[]),
        // Tests and comments are free.
        (
            &[
                ("", ""),
                ("a", "use crate::b::B;"),
                ("b", "// crate::a::A\n#[cfg(test)]\nmod tests {\n    use crate::a::A;\n}"),
            ],
            &[],
        ),
    ];
    for (files, expected) in ways {
        let found: Vec<String> = circles(&crate_of(files)).into_iter().map(|(module, _)| module).collect();
        assert_eq!(found, expected, "{files:?}");
    }
}
