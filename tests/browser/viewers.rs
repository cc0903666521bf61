//! Foxglove, Lichtblick and PlotJuggler look on while the arm moves, by their own protocol.

use std::net::TcpStream;
use std::time::Duration;

use serde_json::{Value, json};
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

use crate::scene::Scene;

fn connect(address: &str) -> Result<WebSocket<TcpStream>, String> {
    let port = address
        .split(':')
        .nth(2)
        .unwrap()
        .split('/')
        .next()
        .unwrap();
    let stream = TcpStream::connect(format!("127.0.0.1:{port}")).unwrap();
    stream
        .set_read_timeout(Some(Duration::from_secs(30)))
        .unwrap();
    let mut request = address.into_client_request().unwrap();
    let headers = request.headers_mut();
    headers.insert("Sec-WebSocket-Protocol", "foxglove.sdk.v1".parse().unwrap());
    headers.insert("Origin", "https://app.foxglove.dev".parse().unwrap());
    let (socket, answer) =
        tungstenite::client(request, stream).map_err(|cause| cause.to_string())?;
    assert_eq!(
        answer.headers()["Sec-WebSocket-Protocol"],
        "foxglove.sdk.v1"
    );
    Ok(socket)
}

fn text(socket: &mut WebSocket<TcpStream>) -> Value {
    loop {
        if let Message::Text(text) = socket.read().unwrap() {
            return serde_json::from_str(text.as_str()).unwrap();
        }
    }
}

/// A viewer gets every period and the robot, in the form of recordings, and moves nothing.
pub(crate) fn viewers_of_other_programs_look_on() {
    let scene = Scene::start("viewers");
    let mut socket = connect(&scene.viewer).unwrap();
    let hello = text(&mut socket);
    assert_eq!(
        (hello["op"].clone(), hello["capabilities"].clone()),
        (json!("serverInfo"), json!([]))
    );
    let offer = text(&mut socket);
    let channels = offer["channels"].as_array().unwrap();
    let id_of = |topic: &str| {
        let found = channels.iter().find(|channel| channel["topic"] == topic);
        let found = found.unwrap_or_else(|| panic!("no {topic}"));
        assert_eq!(found["schemaEncoding"], "ros2msg");
        found["id"].as_u64().unwrap()
    };
    let wanted = ["/canter/setpoint", "/joint_states", "/robot_description"];
    let subscriptions: Vec<Value> = wanted
        .iter()
        .enumerate()
        .map(|(id, topic)| json!({"id": id + 10, "channelId": id_of(topic)}))
        .collect();
    // What it may not do is not heard: the next answer is that of the subscription.
    for wish in [
        json!({"op": "advertise", "channels": [{"id": 1, "topic": "/cmd", "encoding": "json", "schemaName": "x"}]}),
        json!({"op": "subscribe", "subscriptions": subscriptions}),
    ] {
        socket.send(Message::Text(wish.to_string().into())).unwrap();
    }
    let (mut counts, mut last) = ([0_u32; 3], None::<u64>);
    while counts[0] < 2000 {
        let Message::Binary(bytes) = socket.read().unwrap() else {
            continue;
        };
        assert_eq!(bytes[0], 1);
        let id = u32::from_le_bytes(bytes[1..5].try_into().unwrap()) as usize - 10;
        counts[id] += 1;
        let time = u64::from_le_bytes(bytes[5..13].try_into().unwrap());
        if id == 2 {
            assert!(String::from_utf8_lossy(&bytes[13..]).contains("<robot"));
        } else if id == 0 {
            // Time goes on; a loaded machine may skip periods.
            assert!(last.is_none_or(|last| time > last));
            last = Some(time);
        }
    }
    assert!(
        (100..=300).contains(&counts[1]) && counts[2] == 1,
        "{counts:?}"
    );
    let hand = scene.hand.rsplit('#').next().unwrap();
    let (address, _) = scene.viewer.split_once("t=").unwrap();
    for wrong in [hand, "", &"0".repeat(32)] {
        assert!(connect(&format!("{address}t={wrong}")).is_err(), "{wrong}");
    }
}
