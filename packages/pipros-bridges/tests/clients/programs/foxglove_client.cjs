// A Foxglove client: prints what it receives, one JSON object per line, and takes orders from standard input.
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader, MessageWriter } = require("@foxglove/rosmsg-serialization");
const { WebSocket } = require("ws");
const readline = require("readline");

const [address, subprotocol] = process.argv.slice(2);
const socket = new WebSocket(address, [subprotocol]);
const client = new FoxgloveClient({ ws: socket });
const channels = new Map(); // by topic
const services = new Map(); // by name
const subscriptions = new Map(); // reader and topic by id

const say = (event, fields) =>
  console.log(
    JSON.stringify({ event, ...fields }, (_, value) =>
      typeof value === "bigint" ? Number(value) : ArrayBuffer.isView(value) ? Array.from(value) : value,
    ),
  );

client.on("open", () => say("open", { protocol: socket.protocol }));
client.on("error", (error) => say("error", { text: String(error) }));
client.on("close", (event) => say("close", { code: event.code }));
client.on("serverInfo", (info) => say("info", { info }));
client.on("status", (status) => say("status", { level: status.level, text: status.message }));
client.on("advertise", (added) => {
  for (const channel of added) {
    channels.set(channel.topic, channel);
    say("channel", { topic: channel.topic, type: channel.schemaName });
  }
});
client.on("advertiseServices", (added) => {
  for (const service of added) {
    services.set(service.name, service);
    say("service", { name: service.name, type: service.type });
  }
});
client.on("message", ({ subscriptionId, timestamp, data }) => {
  const { topic, reader } = subscriptions.get(subscriptionId);
  say("message", { topic, timestamp, message: reader.readMessage(data) });
});
client.on("time", ({ timestamp }) => say("time", { timestamp }));
client.on("parameterValues", ({ parameters, id }) => say("parameters", { parameters, id }));
client.on("connectionGraphUpdate", (graph) => say("graph", { graph }));
client.on("serviceCallFailure", ({ callId, message }) => say("failure", { callId, text: message }));
client.on("serviceCallResponse", ({ serviceId, callId, data }) => {
  const service = [...services.values()].find(({ id }) => id === serviceId);
  say("response", { callId, response: new MessageReader(parse(service.response.schema)).readMessage(data) });
});
client.on("fetchAssetResponse", ({ requestId, status, data, error }) =>
  say("asset", {
    requestId,
    status,
    error,
    text: data && Buffer.from(data.buffer, data.byteOffset, data.byteLength).toString(),
  }),
);

const orders = {
  subscribe({ topic }) {
    const channel = channels.get(topic);
    const id = client.subscribe(channel.id);
    subscriptions.set(id, { topic, reader: new MessageReader(parse(channel.schema)) });
  },
  publish({ topic, type, definition, message }) {
    const id = client.advertise({ topic, encoding: "ros1", schemaName: type });
    const data = new MessageWriter(parse(definition)).writeMessage(message);
    const send = () => client.sendMessage(id, data);
    setInterval(send, 50);
  },
  call({ name, request, callId }) {
    const service = services.get(name);
    const data = new MessageWriter(parse(service.request.schema)).writeMessage(request);
    client.sendServiceCallRequest({ serviceId: service.id, callId, encoding: "ros1", data });
  },
  getParameters: ({ names, id }) => client.getParameters(names, id),
  setParameters: ({ parameters, id }) => client.setParameters(parameters, id),
  subscribeParameters: ({ names }) => client.subscribeParameterUpdates(names),
  graph: () => client.subscribeConnectionGraph(),
  asset: ({ uri, requestId }) => client.fetchAsset(uri, requestId),
};

readline.createInterface({ input: process.stdin }).on("line", (line) => {
  const { order, ...fields } = JSON.parse(line);
  orders[order](fields);
});
