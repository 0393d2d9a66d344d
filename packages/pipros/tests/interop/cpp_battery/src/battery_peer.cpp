// One of three peers that do everything with each other. Does and prints what client_matrix/peer.py does.
#include <cstdio>
#include <functional>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <ros/ros.h>
#include <roscpp/GetLoggers.h>
#include <roscpp/SetLoggerLevel.h>
#include <rosgraph_msgs/Clock.h>
#include <rosgraph_msgs/TopicStatistics.h>
#include <std_msgs/String.h>
#include <std_msgs/UInt8MultiArray.h>
#include <std_srvs/SetBool.h>
#include <topic_tools/shape_shifter.h>

typedef std_msgs::String String;
typedef ros::MessageEvent<String const> StringEvent;

const std::vector<std::string> PEERS = {"pipros", "rospy", "roscpp"};
const int COUNT = 30;
const int CLOCK_S = 3000;
const size_t LARGE_BYTES = 8000000;

std::string me;
std::mutex turn;
std::set<std::string> said;
std::vector<std::set<std::string> > seen(PEERS.size() + 1);
std::vector<ros::Subscriber> subscribers;
std::vector<ros::Publisher> publishers;  // the last handle's end ends a topic, sent or not

void report(const std::string& aspect, const std::string& peer, const std::string& outcome)
{
  std::lock_guard<std::mutex> hold(turn);
  const std::string line = "@ " + aspect + " " + peer + " " + outcome;
  if (said.insert(line).second)
  {
    std::printf("%s\n", line.c_str());
    std::fflush(stdout);
  }
}

size_t countOf(const std::string& beginning)
{
  std::lock_guard<std::mutex> hold(turn);
  size_t count = 0;
  for (const std::string& line : said) count += line.rfind(beginning, 0) == 0;
  return count;
}

void rest(double seconds = 0.02)
{
  ros::WallDuration(seconds).sleep();
}

void waitForPeers(ros::Publisher& publisher)
{
  while (ros::ok() && publisher.getNumSubscribers() < PEERS.size()) rest();
}

String text(const std::string& data)
{
  String message;
  message.data = data;
  return message;
}

uint8_t patternAt(size_t index)
{
  return index & 0xff;
}

// -- topics -------------------------------------------------------------------------

void publishNumbers(ros::Publisher publisher)
{
  waitForPeers(publisher);
  for (int number = 0; number < COUNT; ++number) publisher.publish(text(std::to_string(number)));
}

void publishLarge(ros::Publisher publisher)
{
  waitForPeers(publisher);
  std_msgs::UInt8MultiArray message;
  message.data.resize(LARGE_BYTES / 256 * 256);
  for (size_t index = 0; index < message.data.size(); ++index) message.data[index] = patternAt(index);
  publisher.publish(message);
}

void tick(ros::Publisher publisher)
{
  for (; ros::ok(); rest(0.01)) publisher.publish(text("tick"));
}

void hearLatched(const std::string& peer, const StringEvent& event)
{
  report("latched", peer, event.getMessage()->data + ", latching=" + event.getConnectionHeader()["latching"]);
}

void hearNumber(
  ros::NodeHandle node, const std::string& aspect, const std::string& peer, std::shared_ptr<int> next,
  const StringEvent& event)
{
  if (event.getMessage()->data != std::to_string((*next)++)) report(aspect, peer, "out of order");
  if (*next == COUNT)
    report(aspect, peer, std::to_string(COUNT) + " in order, " + event.getConnectionHeader()["type"] +
      " from " + event.getPublisherName());
  if (aspect == "plain" && *next == 1)
  {
    boost::function<void(const StringEvent&)> hear = [peer](const StringEvent& event) { hearLatched(peer, event); };
    ros::Subscriber subscriber = node.subscribe<String>("latched/" + peer, 10, hear);
    std::lock_guard<std::mutex> hold(turn);
    subscribers.push_back(subscriber);
  }
}

void hearLarge(const std::string& peer, const std_msgs::UInt8MultiArray& message)
{
  bool isIntact = message.data.size() == LARGE_BYTES / 256 * 256;
  for (size_t index = 0; isIntact && index < message.data.size(); ++index)
    isIntact = message.data[index] == patternAt(index);
  report("large", peer, isIntact ? "intact" : "broken");
}

void relay(ros::NodeHandle node, const std::string& peer, const topic_tools::ShapeShifter& message)
{
  ros::Publisher publisher = message.advertise(node, "relay/" + me + "/" + peer, 1, true);
  publisher.publish(message);
  std::lock_guard<std::mutex> hold(turn);
  publishers.push_back(publisher);
}

void hearStatistics(const rosgraph_msgs::TopicStatistics& message)
{
  if (message.topic.rfind("/tick/", 0) == 0 && message.delivered_msgs > 0 && message.traffic > 0 &&
      message.window_stop > message.window_start)
    report("statistics", message.topic.substr(6), message.node_pub + " heard by " + message.node_sub);
}

// -- services -------------------------------------------------------------------------

bool answer(ros::ServiceEvent<std_srvs::SetBoolRequest, std_srvs::SetBoolResponse>& event)
{
  if (!event.getRequest().data) return false;
  ros::M_string& header = event.getConnectionHeader();
  const std::string persistent = header.count("persistent") ? header["persistent"] : "0";
  event.getResponse().success = true;
  event.getResponse().message = me + " to " + event.getCallerName() + ", persistent=" + persistent;
  return true;
}

void callServices(const std::string& server)
{
  const std::string name = "/" + server + "/answer";
  ros::service::waitForService(name);
  std_srvs::SetBool good, bad;
  good.request.data = true;
  bad.request.data = false;
  if (ros::service::call(name, good)) report("service", server, good.response.message);
  if (!ros::service::call(name, bad)) report("service_error", server, "ServiceException");
  ros::NodeHandle node;
  ros::ServiceClient client = node.serviceClient<std_srvs::SetBool>(name, true);
  std::set<std::string> answers;
  for (int count = 0; count < 3; ++count)
    answers.insert(client.call(good) ? good.response.message : "no answer");
  client.call(bad);
  answers.insert(client.call(good) ? good.response.message : "no answer after an error");
  std::string all;
  for (const std::string& one : answers) all += (all.empty() ? "" : " | ") + one;
  report("persistent", server, all);
}

void setLoggers(const std::string& server)
{
  ros::service::waitForService("/" + server + "/set_logger_level");
  const std::string logger = (server == "roscpp" ? "ros." : "rosout.") + me;
  for (const std::string level : {"warn", "error"})
  {
    roscpp::SetLoggerLevel set;
    set.request.logger = logger;
    set.request.level = level;
    roscpp::GetLoggers get;
    const bool isDone = ros::service::call("/" + server + "/set_logger_level", set) &&
      ros::service::call("/" + server + "/get_loggers", get);
    bool isSet = false;
    for (roscpp::Logger& one : get.response.loggers)
    {
      for (char& letter : one.level) letter = std::tolower(letter);
      isSet = isSet || (one.name == logger && one.level == level);
    }
    if (!isDone || !isSet) return report("loggers", server, level + " was not set");
  }
  report("loggers", server, "followed");
}

// -- parameters and time -----------------------------------------------------------------

void setParameter()
{
  for (int number = 1; ros::ok(); ++number, rest(0.1)) ros::param::set("/matrix/" + me, number);
}

void followParameter(const std::string& peer)
{
  int first = 0, value = 0;
  for (; ros::ok(); rest())
  {
    if (!ros::param::getCached("/matrix/" + peer, value)) continue;
    if (!first) first = value;
    if (value >= first + 3) return report("parameters", peer, "followed");
  }
}

size_t seenBy(int number)
{
  std::lock_guard<std::mutex> hold(turn);
  return seen[number].size();
}

void simulateTime(ros::Publisher clock)
{
  waitForPeers(clock);
  int number = 0;
  while (PEERS[number] != me) ++number;
  while (ros::ok() && seenBy(number ? number - 1 : PEERS.size()) < PEERS.size()) rest();
  const bool isLast = me == PEERS.back();
  int now = CLOCK_S * (number + 1);
  const int last = now + CLOCK_S - 1;
  for (; ros::ok() && (seenBy(number) < PEERS.size() || isLast); rest(0.005))
  {
    if (now < last || isLast) ++now;
    rosgraph_msgs::Clock message;
    message.clock = ros::Time(now);
    clock.publish(message);
  }
}

void seeTime(ros::Publisher publisher)
{
  waitForPeers(publisher);
  while (ros::ok() && countOf("@ latched") < PEERS.size()) rest();
  publisher.publish(text(std::to_string(PEERS.size()) + " " + me));
  for (size_t number = 0; number < PEERS.size(); ++number)
  {
    const ros::Time begin(CLOCK_S * (number + 1));
    while (ros::ok() && ros::Time::now() < begin) ros::Duration(1).sleep();
    report("clock", PEERS[number], "slept");
    publisher.publish(text(std::to_string(number) + " " + me));
  }
}

void subscribeTo(ros::NodeHandle node, const std::string& peer)
{
  for (const std::string aspect : {"plain", "nodelay"})
  {
    std::shared_ptr<int> next(new int(0));
    boost::function<void(const StringEvent&)> hear = [=](const StringEvent& event)
    { hearNumber(node, aspect, peer, next, event); };
    ros::TransportHints hints;
    if (aspect == "nodelay") hints.tcpNoDelay();
    subscribers.push_back(node.subscribe<String>(aspect + "/" + peer, COUNT, hear, ros::VoidConstPtr(), hints));
  }
  boost::function<void(const std_msgs::UInt8MultiArray::ConstPtr&)> large =
    [peer](const std_msgs::UInt8MultiArray::ConstPtr& message) { hearLarge(peer, *message); };
  subscribers.push_back(node.subscribe<std_msgs::UInt8MultiArray>("large/" + peer, 10, large));
  boost::function<void(const String::ConstPtr&)> ignore = [](const String::ConstPtr&) {};
  subscribers.push_back(node.subscribe<String>("tick/" + peer, 10, ignore));
  boost::function<void(const topic_tools::ShapeShifter::ConstPtr&)> passOn =
    [=](const topic_tools::ShapeShifter::ConstPtr& message) { relay(node, peer, *message); };
  subscribers.push_back(node.subscribe<topic_tools::ShapeShifter>("relayed/" + peer, 10, passOn));
  for (const std::string& relayer : PEERS)
  {
    boost::function<void(const StringEvent&)> hear = [=](const StringEvent& event)
    {
      report("relay", peer + " " + relayer, event.getMessage()->data + " from " + event.getPublisherName());
    };
    subscribers.push_back(node.subscribe<String>("relay/" + relayer + "/" + peer, 10, hear));
  }
}

int main(int argc, char** argv)
{
  me = argv[1];
  ros::init(argc, argv, me);
  ros::NodeHandle node, home("~");
  ros::Publisher latched = node.advertise<String>("latched/" + me, 1, true);
  latched.publish(text("old"));
  latched.publish(text("newest"));
  ros::Publisher relayed = node.advertise<String>("relayed/" + me, 1, true);
  relayed.publish(text("sent by " + me));
  boost::function<bool(ros::ServiceEvent<std_srvs::SetBoolRequest, std_srvs::SetBoolResponse>&)> handler = answer;
  ros::AdvertiseServiceOptions options;
  options.initBySpecType<ros::ServiceEvent<std_srvs::SetBoolRequest, std_srvs::SetBoolResponse> >(
    home.resolveName("answer"), handler);
  ros::ServiceServer server = node.advertiseService(options);
  boost::function<void(const String::ConstPtr&)> see = [](const String::ConstPtr& message)
  {
    std::lock_guard<std::mutex> hold(turn);
    seen[message->data[0] - '0'].insert(message->data);
  };
  subscribers.push_back(node.subscribe<String>("seen", 10, see));
  subscribers.push_back(node.subscribe("statistics", 100, hearStatistics));
  for (const std::string& peer : PEERS) subscribeTo(node, peer);
  ros::AsyncSpinner spinner(4);
  spinner.start();
  std::vector<std::thread> tasks;
  for (const std::string& peer : PEERS)
  {
    tasks.emplace_back(callServices, peer);
    tasks.emplace_back(setLoggers, peer);
    tasks.emplace_back(followParameter, peer);
  }
  auto publish = [&](void (*task)(ros::Publisher), const ros::Publisher& publisher)
  {
    std::lock_guard<std::mutex> hold(turn);
    publishers.push_back(publisher);
    tasks.emplace_back(task, publisher);
  };
  publish(publishNumbers, node.advertise<String>("plain/" + me, COUNT));
  publish(publishNumbers, node.advertise<String>("nodelay/" + me, COUNT));
  publish(publishLarge, node.advertise<std_msgs::UInt8MultiArray>("large/" + me, 1));
  publish(tick, node.advertise<String>("tick/" + me, 10));
  publish(simulateTime, node.advertise<rosgraph_msgs::Clock>("/clock", 10));
  publish(seeTime, node.advertise<String>("seen", 10));
  tasks.emplace_back(setParameter);
  ros::waitForShutdown();
  for (std::thread& task : tasks) task.join();
  spinner.stop();
  subscribers.clear();
  publishers.clear();
}
