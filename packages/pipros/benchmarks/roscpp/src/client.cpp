// The workers of packages/pipros/benchmarks/client.py with roscpp: the same topics, messages, windows and output.
//
//     client source KIND QUEUE WINDOW SECONDS PEERS RATE_HZ
//     client sink KIND WINDOW
//     client echo KIND QUEUE
//     client trip KIND QUEUE SECONDS
//     client server
//     client caller PERSISTENT SECONDS

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>
#include <vector>

#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_msgs/Empty.h>
#include <std_msgs/Int32.h>
#include <std_msgs/String.h>
#include <std_srvs/Empty.h>

namespace {

constexpr int kWarmUp = 5;  // messages before the measured ones
constexpr double kSettleS = 1.0;  // before the last of these

using Clock = std::chrono::steady_clock;

const ros::TransportHints kNoDelay = ros::TransportHints().tcpNoDelay();

double secondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

double processorSeconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

void handleCallbacks(double wait_s) {
  ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(wait_s));
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

void fill(std_msgs::String& message, int) { message.data.assign(16, 'x'); }

void fill(sensor_msgs::Imu& message, int) {
  message.header.frame_id = "imu_link";
  message.header.stamp = ros::Time(1, 2);
  message.orientation.w = 1.0;
}

// An image of 1 MB, or of `size` bytes.
void fill(sensor_msgs::Image& message, int size) {
  message.height = size ? 1 : 1024;
  message.width = message.step = size ? size : 1024;
  message.encoding = "mono8";
  message.data.resize(message.height * message.step, 7);
}

void fill(sensor_msgs::PointCloud2& message, int) {
  message.width = 1 << 18;
  message.point_step = 16;
  message.row_step = 1 << 22;
  message.data.resize(1 << 22, 7);
}

// Publish for a while, at full speed if the rate is 0, then print the number of calls.
template <class Message>
void source(int size, int queue, int window, double seconds, unsigned peers, double rate_hz) {
  ros::NodeHandle node;
  Message message;
  fill(message, size);
  int acknowledged = 0;
  ros::Publisher publisher = node.advertise<Message>("flow", queue);
  ros::Publisher end = node.advertise<std_msgs::Empty>("end", 1, true);
  ros::Subscriber acknowledgements = node.subscribe<std_msgs::Int32>(
      "ack", 10, [&](const std_msgs::Int32::ConstPtr& each) { acknowledged = each->data; }, {}, kNoDelay);
  while (publisher.getNumSubscribers() < peers || end.getNumSubscribers() < peers) handleCallbacks(0.01);
  for (int i = 0; i < kWarmUp; ++i) {
    ros::WallDuration(i == kWarmUp - 1 ? kSettleS : 0.02).sleep();
    publisher.publish(message);
  }

  int sent = kWarmUp;
  const double processor_before = processorSeconds();
  const Clock::time_point begin = Clock::now();
  while (secondsSince(begin) < seconds) {
    int count = window ? std::min(10, window - (sent - acknowledged)) : 10;
    if (rate_hz > 0) {
      count = 1;
      const double wait_s = (sent - kWarmUp) / rate_hz - secondsSince(begin);
      if (wait_s > 0) ros::WallDuration(wait_s).sleep();
    }
    for (int i = 0; i < count; ++i) publisher.publish(message);
    sent += std::max(count, 0);
    if (window) handleCallbacks(count > 0 ? 0 : 0.2);
  }
  const double processor = processorSeconds() - processor_before;
  end.publish(std_msgs::Empty());
  ros::WallDuration(1.0).sleep();
  std::printf("@@{\"sent\": %d, \"cpu\": %f}\n", sent - kWarmUp, processor);
}

// Count messages until the source announces its end.
template <class Message>
void sink(int window) {
  ros::NodeHandle node;
  int seen = 0;
  bool has_ended = false;
  double processor_before = 0;
  Clock::time_point first, last;
  const int step = std::max(1, window / 4);
  ros::Publisher acknowledgements = node.advertise<std_msgs::Int32>("ack", 10);
  ros::Subscriber end = node.subscribe<std_msgs::Empty>(
      "end", 1, [&](const std_msgs::Empty::ConstPtr&) { has_ended = true; });
  ros::Subscriber flow = node.subscribe<Message>("flow", 0, [&](const typename Message::ConstPtr&) {
    last = Clock::now();
    if (++seen == kWarmUp) {
      first = last;
      processor_before = processorSeconds();
    }
    if (window && seen % step == 0) {
      std_msgs::Int32 count;
      count.data = seen;
      acknowledgements.publish(count);
    }
  });
  while (!has_ended) handleCallbacks(1);
  for (int count = -1; count != seen;) {
    count = seen;
    handleCallbacks(0.2);
  }
  const double span = std::max(std::chrono::duration<double>(last - first).count(), 1e-9);
  std::printf("@@{\"seen\": %d, \"rate\": %f, \"cpu\": %f}\n", seen - kWarmUp, (seen - kWarmUp) / span,
              processorSeconds() - processor_before);
}

template <class Message>
void echo(int queue) {
  ros::NodeHandle node;
  ros::Publisher back = node.advertise<Message>("back", queue);
  ros::Subscriber forth = node.subscribe<Message>(
      "forth", queue, [&](const typename Message::ConstPtr& each) { back.publish(each); }, {}, kNoDelay);
  ros::spin();
}

// Send messages on a round trip, each after the previous one has returned. Print the median time.
template <class Message>
void trip(int queue, double seconds) {
  ros::NodeHandle node;
  Message message;
  fill(message, 0);
  bool has_returned = false;
  std::vector<double> times;
  ros::Publisher publisher = node.advertise<Message>("forth", queue);
  ros::Subscriber back = node.subscribe<Message>(
      "back", queue, [&](const typename Message::ConstPtr&) { has_returned = true; }, {}, kNoDelay);
  while (!has_returned) {
    publisher.publish(message);
    handleCallbacks(0.1);
  }
  ros::WallDuration(0.3).sleep();
  handleCallbacks(0);
  const Clock::time_point begin = Clock::now();
  while (secondsSince(begin) < seconds) {
    has_returned = false;
    const Clock::time_point sent = Clock::now();
    publisher.publish(message);
    while (!has_returned) handleCallbacks(1);
    times.push_back(secondsSince(sent));
  }
  std::printf("@@{\"median\": %.9f}\n", median(times));
}

bool handleEmpty(std_srvs::Empty::Request&, std_srvs::Empty::Response&) { return true; }

void server() {
  ros::NodeHandle node;
  ros::ServiceServer service = node.advertiseService("empty", handleEmpty);
  std::printf("@@{\"ready\": true}\n");
  std::fflush(stdout);
  ros::spin();
}

void caller(bool is_persistent, double seconds) {
  ros::NodeHandle node;
  ros::service::waitForService("empty");
  ros::ServiceClient client = node.serviceClient<std_srvs::Empty>("empty", is_persistent);
  std_srvs::Empty call;
  client.call(call);
  std::vector<double> times;
  const Clock::time_point begin = Clock::now();
  while (secondsSince(begin) < seconds) {
    const Clock::time_point called = Clock::now();
    client.call(call);
    times.push_back(secondsSince(called));
  }
  std::printf("@@{\"median\": %.9f}\n", median(times));
}

template <class Message>
void runTopicWorker(const std::string& role, int size, char** words) {
  if (role == "source") {
    source<Message>(size, std::atoi(words[0]), std::atoi(words[1]), std::atof(words[2]), std::atoi(words[3]),
                    std::atof(words[4]));
  } else if (role == "sink") {
    sink<Message>(std::atoi(words[0]));
  } else if (role == "echo") {
    echo<Message>(std::atoi(words[0]));
  } else {
    trip<Message>(std::atoi(words[0]), std::atof(words[1]));
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  const std::string role = argv[1];
  ros::init(argc, argv, role, ros::init_options::AnonymousName | ros::init_options::NoSigintHandler);
  if (role == "server") {
    server();
  } else if (role == "caller") {
    caller(std::string(argv[2]) == "true", std::atof(argv[3]));
  } else {
    const std::string whole = argv[2], kind = whole.substr(0, whole.find(':'));
    const int size = kind == whole ? 0 : std::atoi(whole.c_str() + kind.size() + 1);
    if (kind == "string") runTopicWorker<std_msgs::String>(role, size, argv + 3);
    if (kind == "imu") runTopicWorker<sensor_msgs::Imu>(role, size, argv + 3);
    if (kind == "image") runTopicWorker<sensor_msgs::Image>(role, size, argv + 3);
    if (kind == "cloud") runTopicWorker<sensor_msgs::PointCloud2>(role, size, argv + 3);
  }
  return 0;
}
