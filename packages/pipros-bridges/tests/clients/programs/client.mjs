// A client with roslib: makes requests of each kind, and returns the answers. Runs in Node.js and in browsers.
export async function ask({ Ros, Topic, Service, Param }, url) {
  const ros = new Ros({ url });
  const answer = (begin) =>
    new Promise((resolve, reject) => {
      setTimeout(() => reject(new Error("no answer in 60 s")), 60000);
      begin(resolve, reject);
    });
  await answer((resolve, reject) => {
    ros.on("connection", resolve);
    ros.on("error", reject);
  });
  const found = {};
  for (const compression of ["none", "png", "cbor", "cbor-raw"]) {
    const topic = new Topic({ ros, name: "/latched", messageType: "std_msgs/String", compression });
    const message = await answer((resolve) => topic.subscribe(resolve));
    found[compression] = message.data ?? Array.from(message.bytes);
    topic.unsubscribe();
  }
  const echo = new Topic({ ros, name: "/echo", messageType: "std_msgs/String" });
  const command = new Topic({ ros, name: "/cmd", messageType: "std_msgs/String" });
  const echoed = answer((resolve) => echo.subscribe(resolve));
  const timer = setInterval(() => command.publish({ data: "from js" }), 100);
  found.echo = (await echoed).data;
  clearInterval(timer);
  const enable = new Service({ ros, name: "/enable", serviceType: "std_srvs/SetBool" });
  found["robot's"] = await answer((resolve, reject) => enable.callService({ data: true }, resolve, reject));
  const offered = new Service({ ros, name: "/switch", serviceType: "std_srvs/SetBool" });
  offered.advertise((request, response) => {
    response.success = request.data;
    response.message = "from js";
    return true;
  });
  const types = () => answer((resolve, reject) => ros.getServiceType("/switch", resolve, reject));
  while ((await types()) !== "std_srvs/SetBool");
  const own = new Service({ ros, name: "/switch", serviceType: "std_srvs/SetBool" });
  found.own = await answer((resolve, reject) => own.callService({ data: true }, resolve, reject));
  const parameter = new Param({ ros, name: "/from_js" });
  await answer((resolve, reject) => parameter.set([1, { a: 2.5 }], resolve, reject));
  found.parameter = await answer((resolve, reject) => parameter.get(resolve, reject));
  const details = await answer((resolve, reject) => ros.getMessageDetails("geometry_msgs/Pose", resolve, reject));
  found.details = Object.keys(ros.decodeTypeDefs(details));
  const topics = await answer((resolve, reject) => ros.getTopicsAndRawTypes(resolve, reject));
  found.definition = topics.typedefs_full_text[topics.topics.indexOf("/echo")].includes("string data");
  found.actions = await answer((resolve, reject) => ros.getActionServers(resolve, reject));
  ros.close();
  return found;
}
