// Counts from 0, so that a listener can see that nothing is lost, doubled or out of order.
#include <composiv_tryouts/BatteryLevel.h>
#include <ros/ros.h>

int main(int argc, char** argv)
{
  ros::init(argc, argv, "cpp_talker");
  ros::NodeHandle node;
  ros::Publisher publisher = node.advertise<composiv_tryouts::BatteryLevel>("battery_topic", 10);
  ros::Rate rate(20);
  for (int count = 0; ros::ok(); ++count)
  {
    composiv_tryouts::BatteryLevel level;
    level.battery = "%" + std::to_string(count);
    publisher.publish(level);
    rate.sleep();
  }
}
