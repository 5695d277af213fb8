//! The view on the terminal.

use super::view::View;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style, Stylize};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Paragraph, Sparkline, Wrap};
use std::collections::VecDeque;
use supervisor::{ProcessStatus, Status, advice_on_alarm};

/// An error of less than 0.02° fills no bar: at rest it is the encoder's step.
const LEAST_HEIGHT_RAD: f64 = 3.5e-4;

/// Draws all of it.
pub(super) fn draw(frame: &mut Frame, view: &View) {
    let Some(status) = &view.status else {
        let waiting = view.silent.as_deref().unwrap_or("waiting for the instance");
        frame.render_widget(Paragraph::new(waiting), frame.area());
        return;
    };
    let processes = status.processes.len() as u16 + 2;
    let areas: [Rect; 4] = Layout::vertical([
        Constraint::Length(9),
        Constraint::Length(4),
        Constraint::Length(processes),
        Constraint::Min(3),
    ])
    .areas(frame.area());
    let [valve, error, timing, events] = areas;
    let title = format!(" {}, generation {} ", status.instance, status.generation);
    let block = Block::bordered().title(title).title_bottom(" q ends the view, not the valve ");
    frame.render_widget(
        Paragraph::new(valve_lines(view, status)).wrap(Wrap { trim: false }).block(block),
        valve,
    );
    draw_error(frame, error, view, status);
    draw_processes(frame, timing, view, status);
    draw_events(frame, events, view);
}

/// The newest events, whole: what a refusal says at its end is what to do.
fn draw_events(frame: &mut Frame, area: Rect, view: &View) {
    let block = Block::bordered().title(" events ");
    let inner = block.inner(area);
    let (width, height) = (usize::from(inner.width), usize::from(inner.height));
    let lines: Vec<String> = view.events.iter().flat_map(|entry| folded(&entry.to_string(), width)).collect();
    let newest = lines.iter().skip(lines.len().saturating_sub(height));
    let newest: Vec<_> = newest.map(|line| Line::from(line.as_str())).collect();
    frame.render_widget(Paragraph::new(newest).block(block), area);
}

/// A text in lines of at most `width` characters, broken at spaces where there are some; all but the first are indented.
fn folded(text: &str, width: usize) -> Vec<String> {
    const INDENT: &str = "    ";
    let mut lines = vec![String::new()];
    for word in text.split_inclusive(' ') {
        let line = lines.last_mut().map_or(0, |line| line.chars().count());
        let length = word.trim_end().chars().count();
        if line > INDENT.len() && line + length > width {
            lines.push(INDENT.to_owned());
        }
        if let Some(line) = lines.last_mut() {
            line.push_str(word);
        }
    }
    lines
}

fn state_style(status: &Status) -> Style {
    let color = match status.state.as_str() {
        "running" => Color::Green,
        "fault" | "silent" | "quick-stop" => Color::Red,
        "disarmed" => Color::Reset,
        _ => Color::Yellow,
    };
    Style::new().fg(color).add_modifier(Modifier::BOLD)
}

fn valve_lines<'a>(view: &'a View, status: &'a Status) -> Vec<Line<'a>> {
    let state = match &view.silent {
        Some(why) => Span::styled(format!("NO ANSWER: {why}"), Style::new().fg(Color::Red).bold()),
        None => Span::styled(status.state_words(), state_style(status)),
    };
    let alarms = match status.alarms.as_slice() {
        [] => String::new(),
        alarms => format!("ALARM      {}", alarms.join("; ")),
    };
    let advice = match (status.fault_advice.as_str(), status.alarms.first()) {
        ("", Some(alarm)) => advice_on_alarm(alarm),
        (advice, _) => advice,
    };
    let limiting = if status.limiting { "  held back by a limit" } else { "" };
    vec![
        Line::from(vec!["state      ".into(), state]),
        Line::from(format!("set-point  {}", status.set_point_words())),
        Line::from(format!("angle      {}", status.angle_words())),
        Line::from(format!(
            "reserve    {}{limiting}   pulse rate {:.1} kHz   oil {:.2} MPa, {:.1} °C",
            status.reserve_words(),
            status.pulse_rate_hz / 1e3,
            status.pressure_drop_pa / 1e6,
            status.oil_temperature_c
        )),
        Line::from(alarms).fg(Color::Red),
        Line::from(advice),
    ]
}

fn draw_error(frame: &mut Frame, area: Rect, view: &View, status: &Status) {
    let full = view.errors_rad.iter().copied().fold(LEAST_HEIGHT_RAD, f64::max);
    let title = format!(
        " following error {:.4}°, peak since arming {:.4}°; bars from 0 to {:.4}° ",
        status.following_error_rad.to_degrees(),
        status.following_error_peak_rad.to_degrees(),
        full.to_degrees()
    );
    let block = Block::bordered().title(title);
    let inner = block.inner(area);
    frame.render_widget(block, area);
    frame.render_widget(sparkline(&view.errors_rad, usize::from(inner.width), full), inner);
}

fn draw_processes(frame: &mut Frame, area: Rect, view: &View, status: &Status) {
    // As wide as the columns below it.
    let heading = format!(
        "{:<20} {:>8} {:>7} {:>6} {:>14}",
        "process", "overruns", "skipped", "missed", "latency/most"
    );
    let block = Block::bordered().title(format!("{heading}: a full bar "));
    let inner = block.inner(area);
    frame.render_widget(block, area);
    for (row, (name, process)) in status.processes.iter().enumerate().take(usize::from(inner.height)) {
        let line = Rect { y: inner.y + row as u16, height: 1, ..inner };
        let [words, history] = Layout::horizontal([Constraint::Length(68), Constraint::Min(4)]).areas(line);
        let most_us = view.latencies_us.get(name).into_iter().flatten().copied().fold(0.0, f64::max);
        frame.render_widget(process_line(name, process, most_us), words);
        if let Some(latencies) = view.latencies_us.get(name) {
            frame.render_widget(sparkline(latencies, usize::from(history.width), most_us), history);
        }
    }
}

fn process_line(name: &str, process: &ProcessStatus, most_us: f64) -> Line<'static> {
    let ProcessStatus { overruns, skipped_cycles, missed_samples, wake_up_latency_us, .. } = process;
    let text = format!(
        "{name:<20} {overruns:>8} {skipped_cycles:>7} {missed_samples:>6} {wake_up_latency_us:>5.0}/{most_us:>5.0} µs"
    );
    match (process.silent, process.late) {
        (true, _) => Line::from(format!("{text} SILENT")).fg(Color::Red),
        (false, true) => Line::from(format!("{text} late")).fg(Color::Yellow),
        (false, false) => Line::from(text),
    }
}

/// Bars of the newest values that fit; the highest stands for the largest of them, or for `full` where that is more.
fn sparkline(history: &VecDeque<f64>, width: usize, full: f64) -> Sparkline<'static> {
    let skipped = history.len().saturating_sub(width);
    let shown: Vec<f64> = history.iter().skip(skipped).copied().collect();
    let largest = shown.iter().copied().fold(full.max(f64::MIN_POSITIVE), f64::max);
    Sparkline::default().data(shown.into_iter().map(move |value| (value / largest * 1e3) as u64)).max(1000)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;

    fn screen(view: &View) -> String {
        let mut terminal = Terminal::new(TestBackend::new(110, 24)).unwrap();
        terminal.draw(|frame| draw(frame, view)).unwrap();
        terminal.backend().to_string()
    }

    fn status() -> Status {
        let process = ProcessStatus { overruns: 3, wake_up_latency_us: 57.0, ..ProcessStatus::default() };
        Status {
            instance: "bench".to_owned(),
            state: "running".to_owned(),
            fault: "none".to_owned(),
            homed: true,
            angle_rad: 0.3,
            angle_heard: true,
            processes: [("step-controller".to_owned(), process)].into(),
            ..Status::default()
        }
    }

    #[test]
    fn it_shows_what_an_operator_looks_for() {
        let mut view = View::default();
        assert!(screen(&view).contains("waiting for the instance"));
        view.take(status());
        let shown = screen(&view);
        for expected in ["bench, generation", "running", "17.189°", "step-controller", "57/   57 µs"] {
            assert!(shown.contains(expected), "{expected} is missing:\n{shown}");
        }
    }

    #[test]
    fn long_events_are_folded_and_none_of_them_is_lost() {
        let text = "12:00:01.250Z  refused    arm: not possible in this state; first: stepvalve reset --instance one";
        for width in [20, 40, 76] {
            let lines = folded(text, width);
            assert!(lines.iter().all(|line| line.trim_end().chars().count() <= width.max(24)), "{lines:?}");
            let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
            assert_eq!(words(&lines.join(" ")), words(text));
        }
    }

    #[test]
    fn an_instance_that_does_not_answer_is_not_shown_as_running() {
        let mut view = View::default();
        view.take(status());
        view.unanswered("gone".to_owned());
        let shown = screen(&view);
        assert!(shown.contains("NO ANSWER: gone") && !shown.contains("running"), "{shown}");
    }

    #[test]
    fn a_controller_that_hangs_is_named() {
        let mut view = View::default();
        let hung = Status {
            state: "silent".to_owned(),
            last_state: "running".to_owned(),
            controller_silent_s: 0.3,
            ..status()
        };
        view.take(hung);
        let shown = screen(&view);
        assert!(shown.contains("UNKNOWN: the controller has said nothing for 0.3 s"), "{shown}");
    }
}
