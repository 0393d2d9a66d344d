// Publishes the water level of a tank, and adds numbers.
#include <mixed/Add.h>
#include <mixed/Level.h>
#include <ros/ros.h>

bool add(mixed::Add::Request& request, mixed::Add::Response& response) {
  response.sum = request.a + request.b;
  return true;
}

int main(int argc, char** argv) {
  ros::init(argc, argv, "talker");
  ros::NodeHandle node;
  ros::ServiceServer server = node.advertiseService("add", add);
  ros::Publisher publisher = node.advertise<mixed::Level>("level", 10);
  mixed::Level level;
  level.tank = "north";
  level.height = 1.5;
  for (ros::Rate rate(10); ros::ok(); rate.sleep()) {
    publisher.publish(level);
    ros::spinOnce();
  }
}
