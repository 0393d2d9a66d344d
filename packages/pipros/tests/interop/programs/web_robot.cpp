// A robot for a client of rosbridge: repeats /cmd on /echo, has a latched /imu, and the service /enable.
#include <ros/ros.h>
#include <sensor_msgs/Imu.h>
#include <std_msgs/String.h>
#include <std_srvs/SetBool.h>

int main(int argc, char** argv) {
  ros::init(argc, argv, "robot");
  ros::NodeHandle node;
  ros::Publisher echo = node.advertise<std_msgs::String>("echo", 10);
  ros::Publisher imu = node.advertise<sensor_msgs::Imu>("imu", 1, true);
  sensor_msgs::Imu values;
  values.header.frame_id = "base";
  values.orientation.w = 1.0;
  values.orientation_covariance[8] = 0.5;
  imu.publish(values);
  boost::function<void(const std_msgs::String&)> repeat = [&](const std_msgs::String& message) {
    echo.publish(message);
  };
  ros::Subscriber commands = node.subscribe<std_msgs::String>("cmd", 10, repeat);
  boost::function<bool(std_srvs::SetBool::Request&, std_srvs::SetBool::Response&)> enable =
      [](std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response) {
        response.success = request.data;
        response.message = "from roscpp";
        return true;
      };
  ros::ServiceServer service = node.advertiseService("enable", enable);
  // A client of the browser's service, once it exists.
  ros::ServiceClient browser = node.serviceClient<std_srvs::SetBool>("from_browser");
  ros::AsyncSpinner spinner(2);
  spinner.start();
  browser.waitForExistence();
  std_srvs::SetBool call;
  call.request.data = true;
  std_msgs::String answer;
  answer.data = browser.call(call) ? call.response.message : "no answer";
  ros::Publisher answers = node.advertise<std_msgs::String>("answers", 1, true);
  answers.publish(answer);
  ros::waitForShutdown();
}
