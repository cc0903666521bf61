// Where the arm is, in numbers, and what happened.

import { JOINTS } from './colours.js';

const get = (id) => document.getElementById(id);
/** A number with so many digits, and no minus before a zero. */
export const digits = (value, count) => value.toFixed(count).replace(/^-(?=0(\.0*)?$)/, '');
const degrees = (angle) => digits(angle * 180 / Math.PI, 2);

/** Roll, pitch and yaw about the fixed axes of a quaternion w, x, y, z. */
export function rollPitchYaw([w, x, y, z]) {
  return [
    Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
    Math.asin(Math.min(Math.max(2 * (w * y - z * x), -1), 1)),
    Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
  ];
}

/** The axes z and x of a quaternion w, x, y, z: as programs write them. */
export function axes([w, x, y, z]) {
  return {
    z: [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
    x: [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
  };
}

/** Point (m) and turn (w, x, y, z) in a frame: x, y, z, qw, qx, qy, qz. */
export function inFrame(point, [w, x, y, z], frame) {
  const [fw, fx, fy, fz] = frame.slice(3);
  // The conjugate of the frame's turn, times the turn, and on the point.
  const turn = [
    fw * w + fx * x + fy * y + fz * z, fw * x - fx * w - fy * z + fz * y,
    fw * y + fx * z - fy * w - fz * x, fw * z - fx * y + fy * x - fz * w,
  ];
  const away = point.map((value, axis) => value - frame[axis]);
  const { z: third, x: first } = axes([fw, fx, fy, fz]);
  const second = [
    third[1] * first[2] - third[2] * first[1], third[2] * first[0] - third[0] * first[2],
    third[0] * first[1] - third[1] * first[0],
  ];
  const along = (axis) => axis.reduce((sum, value, k) => sum + value * away[k], 0);
  return { point: [first, second, third].map(along), turn };
}

export class Readout {
  setRobot(robot) {
    this.robot = robot;
    get('joints').replaceChildren(...robot.joints.map((name, k) => {
      const line = document.createElement('div');
      const [label, bar, value] = [document.createElement('span'), document.createElement('i'), document.createElement('span')];
      label.textContent = `J${k + 1}`;
      label.title = name;
      bar.style.setProperty('--mark', JOINTS[k % JOINTS.length]);
      line.append(label, bar, value);
      return line;
    }));
    const names = ['X', 'Y', 'Z', 'roll', 'pitch', 'yaw'];
    get('pose').replaceChildren(...names.map((name) => {
      const cell = document.createElement('div');
      const [label, value] = [document.createElement('b'), document.createElement('span')];
      label.textContent = name;
      cell.append(label, value);
      return cell;
    }));
  }

  joints(positions) {
    for (const [k, line] of [...get('joints').children].entries()) {
      const [low, high] = [this.robot.lower[k] ?? -Math.PI, this.robot.upper[k] ?? Math.PI];
      const slides = this.robot.slides[k];
      const share = (positions[k] - low) / (high - low);
      line.children[1].style.setProperty('--at', `${Math.min(Math.max(share, 0), 1) * 100}%`);
      line.children[2].textContent = slides ? `${digits(positions[k] * 1000, 1)} mm` : `${degrees(positions[k])}\u00b0`;
    }
  }

  pose(point, angles) {
    const texts = [...point.map((value) => digits(value * 1000, 2)), ...angles.map((angle) => `${degrees(angle)}\u00b0`)];
    for (const [k, cell] of [...get('pose').children].entries()) cell.lastChild.textContent = texts[k];
  }

  notes(notes) {
    const list = get('notes');
    for (const { note } of notes) {
      const item = document.createElement('li');
      const [text, kind] = words(note);
      this.onnote?.(text, kind);
      item.textContent = text;
      item.dataset.kind = kind;
      list.append(item);
    }
    while (list.children.length > 300) list.firstChild.remove();
    list.scrollTop = list.scrollHeight;
  }

  /** A sentence of the page itself. */
  tell(text) { this.notes([{ note: { event: 'page', text } }]); }
}

/** The line that a note is about; what a plan gives has none. */
const at = ({ line }) => (line > 0 ? `${line}  ` : '');

/** A note in words, and its kind. */
export function words(note) {
  switch (note.event) {
    case 'started': return [`${at(note)}${note.name}, ${note.planned_s.toFixed(2)} s`, ''];
    case 'done': return [`${at(note)}${note.name} done`, ''];
    case 'refused': return [`${at(note)}${note.name} refused: ${note.error.message}`, 'bad'];
    case 'message': return [note.text, 'said'];
    case 'ended': return [`the program ended with reason ${note.reason}`, note.reason > 0 ? 'warn' : ''];
    case 'stopped': return ['stopped', 'warn'];
    case 'aborted': return [`aborted, ${note.dropped} commands dropped`, 'warn'];
    case 'faulted': return [`fault: ${note.reason}`, 'bad'];
    case 'recovered': return ['recovered', ''];
    case 'not-arrived': return [`joint ${note.joint} has not arrived: ${digits(note.error * 1000, 1)} mrad or mm are left`, 'warn'];
    case 'end-missed': return [`the measured tool came no nearer to its end than ${digits(note.off_m * 1000, 3)} mm and ${digits(note.off_rad * 180 / Math.PI, 3)} degrees`, 'warn'];
    case 'not-settled': return [`the driver does not come to rest: joint ${note.joint} is ${digits(note.error * 1000, 3)} mrad or mm from the last setpoint`, 'warn'];
    case 'speed-asked': return [`the arm asks for ${digits(note.share * 100, 0)} % of the speed`, 'warn'];
    case 'closed': return ['the engine has ended', 'warn'];
    case 'page': return [note.text, 'warn'];
    default: return [note.event || JSON.stringify(note), ''];
  }
}
