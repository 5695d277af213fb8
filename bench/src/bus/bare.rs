//! iceoryx2 alone: the same bytes over its own services, without header, CRC or checks.

use super::{BACK_WORDS, Carrier, THERE_WORDS, other_side, place};
use crate::programs::Workplace;
use crate::timing::Times;
use anyhow::{Result, anyhow, ensure};
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::{
    Config, FileName, LogLevel, Node, NodeBuilder, Path as IoxPath, SemanticString, SignalHandlingMode,
    ZeroCopySend, ipc, set_log_level,
};
use realtime::now_ns;
use std::fmt::Debug;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

/// How long the other side may take to answer the first time.
const PATIENCE: Duration = Duration::from_secs(10);
/// The trip that ends the other side.
const END: u64 = u64::MAX;

type There = [u64; THERE_WORDS];
type Back = [u64; BACK_WORDS];

pub(super) fn run(folder: &Workplace, trips: u64, times: &mut Times) -> Result<()> {
    let root = folder.path("bare");
    let result = trip_all(&root, trips, times);
    place(&root).wipe()?;
    result
}

fn trip_all(root: &Path, trips: u64, times: &mut Times) -> Result<()> {
    let node = node(root)?;
    let there = publisher::<There>(&node, "there")?;
    let back = subscriber::<Back>(&node, "back")?;
    let mut echo = other_side(Carrier::Bare, root, Stdio::null(), Stdio::null())?;
    let begun = Instant::now();
    // The first goes out until the other side is there to hear it.
    while receive(&back)?.is_none() {
        ensure!(begun.elapsed() < PATIENCE, "the other side did not answer");
        send(&there, message(0))?;
        std::thread::sleep(Duration::from_millis(5));
    }
    std::thread::sleep(Duration::from_millis(20));
    while receive(&back)?.is_some() {}
    for trip in 1..=trips {
        let begun = now_ns();
        send(&there, message(trip))?;
        while receive(&back)?.is_none_or(|back| back.first() != Some(&trip)) {
            std::hint::spin_loop();
        }
        times.add(now_ns() - begun);
    }
    send(&there, message(END))?;
    echo.wait()?;
    Ok(())
}

pub(super) fn echo(root: &Path) -> Result<()> {
    let node = node(root)?;
    let there = subscriber::<There>(&node, "there")?;
    let back = publisher::<Back>(&node, "back")?;
    loop {
        let Some(message) = receive(&there)? else {
            std::hint::spin_loop();
            continue;
        };
        let trip = message.first().copied().unwrap_or(END);
        if trip == END {
            return Ok(());
        }
        let mut answer = [0; BACK_WORDS];
        answer.first_mut().into_iter().for_each(|first| *first = trip);
        send(&back, answer)?;
    }
}

fn message(trip: u64) -> There {
    let mut message = [0; THERE_WORDS];
    message.first_mut().into_iter().for_each(|first| *first = trip);
    message
}

fn node(root: &Path) -> Result<Node<ipc::Service>> {
    set_log_level(LogLevel::Error);
    let text = root.as_os_str().as_encoded_bytes();
    let mut config = Config::default();
    config.global.set_root_path(&IoxPath::new(text).map_err(failed)?);
    config.global.prefix = FileName::new(place(root).prefix.as_bytes()).map_err(failed)?;
    let builder = NodeBuilder::new().config(&config).signal_handling_mode(SignalHandlingMode::Disabled);
    builder.create::<ipc::Service>().map_err(failed)
}

fn publisher<T: ZeroCopySend + Copy + Debug + 'static>(
    node: &Node<ipc::Service>,
    name: &str,
) -> Result<Publisher<ipc::Service, T, ()>> {
    let name = name.try_into().map_err(failed)?;
    let service = node.service_builder(&name).publish_subscribe::<T>().open_or_create().map_err(failed)?;
    service.publisher_builder().create().map_err(failed)
}

fn subscriber<T: ZeroCopySend + Copy + Debug + 'static>(
    node: &Node<ipc::Service>,
    name: &str,
) -> Result<Subscriber<ipc::Service, T, ()>> {
    let name = name.try_into().map_err(failed)?;
    let service = node.service_builder(&name).publish_subscribe::<T>().open_or_create().map_err(failed)?;
    service.subscriber_builder().create().map_err(failed)
}

fn send<T: ZeroCopySend + Copy + Debug>(
    publisher: &Publisher<ipc::Service, T, ()>,
    message: T,
) -> Result<()> {
    let sample = publisher.loan_uninit().map_err(failed)?.write_payload(message);
    sample.send().map_err(failed)?;
    Ok(())
}

fn receive<T: ZeroCopySend + Copy + Debug>(
    subscriber: &Subscriber<ipc::Service, T, ()>,
) -> Result<Option<T>> {
    Ok(subscriber.receive().map_err(failed)?.map(|sample| *sample))
}

fn failed(error: impl Debug) -> anyhow::Error {
    anyhow!("iceoryx2: {error:?}")
}
