// Prints what it hears and from whom, one line a message.
#include <composiv_tryouts/BatteryLevel.h>
#include <cstdio>
#include <ros/ros.h>

void hear(const ros::MessageEvent<composiv_tryouts::BatteryLevel const>& event)
{
  std::printf("heard %s from %s\n", event.getMessage()->battery.c_str(), event.getPublisherName().c_str());
  std::fflush(stdout);
}

int main(int argc, char** argv)
{
  ros::init(argc, argv, "cpp_listener");
  ros::NodeHandle node;
  ros::Subscriber subscriber = node.subscribe("battery_topic", 10, hear);
  ros::spin();
}
