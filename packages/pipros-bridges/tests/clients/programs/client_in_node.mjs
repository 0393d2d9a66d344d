// node client_in_node.mjs ROSLIB URL
import { ask } from "./client.mjs";

const [roslib, url] = process.argv.slice(2);
console.log(JSON.stringify(await ask(await import(roslib), url)));
process.exit(0);
