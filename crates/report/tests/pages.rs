//! Pages as a caller sees them: whole files that need nothing else, whatever is in them.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use report::{Block, Panel, ReportError, RunData, Section, Table, TimeAxis, run_page};

fn run(samples: usize) -> RunData {
    let time: Vec<f64> = (0..samples).map(|k| k as f64 * 1e-3).collect();
    let axis = TimeAxis::new(&time, 2, &[]).unwrap();
    let trace = axis.trace(time.iter().map(|s| s.sin())).unwrap();
    let constant = axis.trace(time.iter().map(|_| f64::NAN)).unwrap();
    let panels = vec![Panel::new("Angle <i>").with("a & b", "deg", trace).with("missing", "deg", constant)];
    RunData {
        title: "<b>run</b>".into(),
        headline: "5 < 6 & \"7\"".into(),
        summary: vec![("peak".into(), "< 1".into())],
        panels,
        texts: vec![("Scenario".into(), "</pre></script>".into())],
        ..RunData::default()
    }
}

#[test]
fn a_page_is_one_file_and_escapes_what_it_is_given() {
    let html = run_page(run(1000)).to_html();
    assert!(html.contains("<title>&lt;b&gt;run&lt;/b&gt;</title>"));
    assert!(html.contains("5 &lt; 6 &amp; &quot;7&quot;"));
    assert!(html.contains("<pre>&lt;/pre&gt;&lt;/script&gt;</pre>"));
    assert!(html.contains("Angle \\u003ci>"));
    assert!(html.contains("default-src 'none'"));
    assert_eq!(html.matches("<script").count(), html.matches("</script>").count());
    for outside in ["src=\"http", "href=\"http", "@import", "url(http", "<link rel=\"stylesheet"] {
        assert!(!html.contains(outside), "{outside}");
    }
    assert!(html.contains("The MIT License"), "uPlot's licence travels with it");
}

#[test]
fn empty_and_single_sample_runs_make_pages() {
    assert!(run_page(RunData::default()).to_html().contains("No samples."));
    assert!(run_page(run(0)).to_html().contains("No samples."));
    assert!(run_page(run(1)).to_html().contains("1 sample."));
}

#[test]
fn a_page_appears_whole_or_not_at_all() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.html");
    run_page(run(10)).write_html(&path).unwrap();
    let first = std::fs::read_to_string(&path).unwrap();
    assert!(first.ends_with("</html>\n"));
    run_page(run(20)).write_html(&path).unwrap();
    assert_ne!(std::fs::read_to_string(&path).unwrap(), first);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "nothing else is left");

    let nowhere = folder.path().join("none").join("run.html");
    let error = run_page(run(10)).write_html(&nowhere).unwrap_err();
    assert!(matches!(&error, ReportError::Write { path, .. } if *path == nowhere), "{error}");
}

#[test]
fn cells_of_a_table_with_sentences_know_their_columns() {
    let text = |cells: [&str; 2]| cells.map(str::to_owned).to_vec();
    let page = |rows| {
        let table = Table { header: text(["\"cause\"", "for it"]), rows };
        let mut page = report::Page::new("t", "");
        page.sections.push(Section::new("s").with(Block::Table(table)));
        page.to_html()
    };
    let short = page(vec![text(["Coulomb", "1.5"])]);
    assert!(!short.contains("<table class=\"as-list\">") && short.contains("<td>Coulomb</td>"));
    let long =
        page(vec![text(["Coulomb", "its friction is higher than the model has it, in both directions"])]);
    assert!(
        long.contains("<table class=\"as-list\">")
            && long.contains("<td data-name=\"&quot;cause&quot;\">Coulomb</td>")
    );
}

#[test]
fn numbers_in_tables_stand_to_the_right() {
    let text = |cells: [&str; 2]| cells.map(str::to_owned).to_vec();
    let rows = vec![text(["Coulomb", "1.5"]), text(["offset", "−0.2"]), text(["other", "–"])];
    let table = Table { header: text(["name", "value"]), rows };
    let mut page = report::Page::new("t", "");
    page.sections.push(Section::new("s").with(Block::Table(table)));
    let html = page.to_html();
    assert!(html.contains("<th>name</th><th class=\"number\">value</th>"));
    assert!(html.contains("<td>offset</td><td class=\"number\">−0.2</td>"));
}

#[test]
fn numbers_among_words_stand_where_the_words_stand() {
    let text = |cells: [&str; 2]| cells.map(str::to_owned).to_vec();
    let rows = vec![text(["mode", "in-process"]), text(["cycles", "5192"])];
    let mut page = report::Page::new("t", "");
    page.sections.push(Section::new("s").with(Block::Table(Table { header: text(["", "A"]), rows })));
    let html = page.to_html();
    assert!(html.contains("<th>A</th>") && html.contains("<td>cycles</td><td>5192</td>"));
}
