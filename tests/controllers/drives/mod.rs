//! A stand-in for six CiA 402 drives on EtherCAT: a process of its own in a network namespace.
//!
//! It is written after the standards by the same hands as the driver; the master's half of EtherCAT is
//! that of the crate `ethercrab`, which others wrote.

mod bus;
mod dictionary;
mod eeprom;
mod esc;
mod servo;

use std::io::{BufRead, Write};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use driver_cia402::EtherSocket;
use scheduling::{RealTimeRequest, now_ns, request_real_time};

use bus::Bus;
use esc::Device;
use servo::{Peaks, Servo};

/// Runs the drives: the interface, whether they have clocks, then for each drive its counts per rad
/// and its first position in counts. Commands come on standard input, an answer for each.
pub(crate) fn run(arguments: &[String]) {
    let (interface, clocked) = (&arguments[0], arguments[1] == "clocks");
    let numbers: Vec<f64> = arguments[2..]
        .iter()
        .map(|word| word.parse().unwrap())
        .collect();
    let count = numbers.len() / 2;
    let device = |number: usize| {
        let servo = Servo::new(numbers[2 * number], numbers[2 * number + 1]);
        Device::new(number, number + 1 == count, clocked, servo)
    };
    let mut bus = Bus {
        devices: (0..count).map(device).collect(),
        cycles: 0,
        distance: [0.0; 2],
        cut: usize::MAX,
    };
    let socket = EtherSocket::open(interface).unwrap();
    let _granted = request_real_time(RealTimeRequest {
        priority: 90,
        lock_memory: false,
        low_latency: false,
        ..RealTimeRequest::default()
    });
    let commands = read_commands();
    println!("ready");
    let mut frame = [0; 1600];
    loop {
        let came = socket.receive(&mut frame, Duration::from_micros(500));
        if let Some(length) = came.unwrap() {
            // A frame is processed in the order of the bus, then sent back.
            go_on(&mut bus);
            if bus.cut > 0 && bus.pass(&mut frame[..length]) {
                socket.send(&frame[..length]).unwrap();
            }
        }
        go_on(&mut bus);
        match commands.try_recv() {
            Ok(line) => {
                println!("{}", obey(&mut bus, &line));
                std::io::stdout().flush().unwrap();
            }
            Err(std::sync::mpsc::TryRecvError::Disconnected) => return,
            Err(std::sync::mpsc::TryRecvError::Empty) => {}
        }
    }
}

fn go_on(bus: &mut Bus) {
    let now = now_ns();
    for device in &mut bus.devices {
        device.go_on(now);
    }
}

/// Lines of standard input, by a thread of their own.
fn read_commands() -> Receiver<String> {
    let (sender, commands) = channel();
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().lines() {
            let Ok(line) = line else { return };
            if sender.send(line).is_err() {
                return;
            }
        }
    });
    commands
}

fn obey(bus: &mut Bus, line: &str) -> String {
    let words: Vec<&str> = line.split(' ').collect();
    let number = |place: usize| words[place].parse::<f64>().unwrap();
    match words[0] {
        // A drive fails with an error code.
        "fail" => bus.devices[number(1) as usize].servo.fail(number(2) as u16),
        // A drive gets another bandwidth.
        "slow" => bus.devices[number(1) as usize].servo.bandwidth = number(2),
        // The cable is cut before a device.
        "cut" => bus.cut = number(1) as usize,
        "mend" => bus.cut = usize::MAX,
        // Cycles, then since the last look: largest acceleration and jerk of the targets, mean distance of the
        // frames from the middle between two pulses.
        "look" => {
            let all = bus.devices.iter_mut().map(|device| &mut device.servo);
            let peaks = all.map(|servo| std::mem::take(&mut servo.peaks));
            let most = peaks.fold(Peaks::default(), |a, b| Peaks {
                acceleration: a.acceleration.max(b.acceleration),
                jerk: a.jerk.max(b.jerk),
            });
            let [sum, count] = std::mem::take(&mut bus.distance);
            let distance = sum / f64::max(count, 1.0);
            return format!(
                "{} {} {} {distance}",
                bus.cycles, most.acceleration, most.jerk
            );
        }
        // Drives that are enabled, that rest, and resets of faults.
        "state" => {
            let count = |is: &dyn Fn(&Servo) -> bool| {
                bus.devices
                    .iter()
                    .filter(|device| is(&device.servo))
                    .count()
            };
            let resets: u32 = bus.devices.iter().map(|device| device.servo.resets).sum();
            return format!(
                "{} {} {resets}",
                count(&Servo::is_enabled),
                count(&Servo::rests)
            );
        }
        _ => return "unknown".to_owned(),
    }
    "done".to_owned()
}
