// Prints how roscpp converts the parameters /rows/r0, /rows/r1, ...: a line of JSON for each, null for no value.
#include <ros/ros.h>

#include <iomanip>
#include <iostream>
#include <sstream>

std::string shown(const std::string& value) { return '"' + value + '"'; }
std::string shown(bool value) { return value ? "true" : "false"; }
std::string shown(int value) { return std::to_string(value); }
std::string shown(double value) {
  std::ostringstream text;
  text << std::setprecision(17) << value;
  return std::isfinite(value) ? text.str() : '"' + text.str() + '"';
}

template <class Item>
std::string shown(const std::vector<Item>& items) {
  std::string text;
  for (Item each : items) text += (text.empty() ? "" : ", ") + shown(each);
  return '[' + text + ']';
}

template <class Value>
void read(const char* name, const std::string& parameter) {
  Value value;
  bool found = ros::param::get(parameter, value);
  std::cout << '"' << name << "\": " << (found ? shown(value) : "null");
}

int main(int argc, char** argv) {
  ros::init(argc, argv, "parameters");
  for (int row = 0; ros::param::has("/rows/r" + std::to_string(row)); row++) {
    std::string name = "/rows/r" + std::to_string(row);
    std::cout << '{';
    read<int>("int", name);
    std::cout << ", ", read<double>("double", name);
    std::cout << ", ", read<bool>("bool", name);
    std::cout << ", ", read<std::string>("string", name);
    std::cout << ", ", read<std::vector<double>>("doubles", name);
    std::cout << ", ", read<std::vector<int>>("ints", name);
    std::cout << ", ", read<std::vector<bool>>("bools", name);
    std::cout << ", ", read<std::vector<std::string>>("strings", name);
    std::cout << '}' << std::endl;
  }
}
