// Prints a session with a stroke of every brush that artists can choose, and plain strokes, opaque and of glass.
//
//   node tests/gltf_validator/session.mjs > brushes.ron
import { readFileSync } from 'node:fs';

const table = readFileSync(new URL('../../crates/osp-session/src/brush/brushes.ron', import.meta.url), 'utf8');
const rows = table.split('\n').filter((row) => row.includes('is_offered:true'));
const brushes = rows.map((row) => row.match(/name:"([^"]+)"/)[1]);
const families = new Set(rows.map((row) => row.match(/family:(\w+)/)[1]));
if (brushes.length < 40 || families.size < 6) {
  console.error(`error: only ${brushes.length} brushes of ${families.size} families were found`);
  process.exit(1);
}
const number = (value) => value.toFixed(4);
const lines = ['Header(format:2,name:"every brush",source:"session.mjs",' +
  'camera:(p:(0.0,1.6,4.0),q:(0.0,0.0,0.0,1.0),fov_degrees:60.0))'];
const paints = [...brushes.map((brush) => `,paint:(brush:"${brush}",seed:7)`), '', ''];
paints.forEach((paint, stroke) => {
  const alpha = stroke === paints.length - 1 ? '0.5' : '1.0';
  lines.push(`Begin(t:0.0,stroke:${stroke},tool:Ribbon,width:0.05,color:(1.0,0.5,0.2,${alpha}),thinnest:1.0${paint})`);
  const [x, y] = [(stroke % 8) * 0.6, Math.floor(stroke / 8) * 0.3];
  for (let i = 0; i < 40; i += 1) {
    const p = [x + i * 0.012, y + 0.05 * Math.sin(i / 4), 0.05 * Math.cos(i / 4)].map(number).join(',');
    const pressure = number(0.3 + 0.7 * Math.sin((i * Math.PI) / 40));
    lines.push(`Point(t:0.0,stroke:${stroke},p:(${p}),q:(0.0,0.0,0.0,1.0),pressure:${pressure})`);
  }
  lines.push(`End(t:0.0,stroke:${stroke})`);
});
console.log(lines.join('\n'));
