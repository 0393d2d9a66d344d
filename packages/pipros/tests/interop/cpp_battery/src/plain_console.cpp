// A backend of rosconsole that prints: the one of Debian's package keeps dangling pointers into log4cxx 1.0, and
// crashes as soon as a thread other than the first makes a logger. What goes over the wire is roscpp's all the same.
#include <cstdio>
#include <map>
#include <mutex>
#include <string>

#include <ros/console.h>
#include <ros/console_impl.h>

namespace
{
// Never destroyed: roscpp logs to the very end.
typedef std::map<std::string, ros::console::Level> Loggers;
std::mutex& turn = *new std::mutex;
Loggers& loggers = *new Loggers{{"ros", ros::console::levels::Info}};
ros::console::LogAppender* appender = nullptr;
}

namespace ros { namespace console { namespace impl {

void initialize() {}

void shutdown() {}

void register_appender(LogAppender* newAppender)
{
  appender = newAppender;
}

void deregister_appender(LogAppender*)
{
  appender = nullptr;
}

void print(void*, Level level, const char* text, const char* file, const char* function, int line)
{
  std::fprintf(stderr, "[%s] %s\n", level >= levels::Error ? "ERROR" : level == levels::Warn ? "WARN" : "INFO", text);
  if (appender) appender->log(level, text, file, function, line);
}

void* getHandle(const std::string& name)
{
  std::lock_guard<std::mutex> hold(turn);
  return &*loggers.insert({name, loggers["ros"]}).first;
}

bool isEnabledFor(void* handle, Level level)
{
  std::lock_guard<std::mutex> hold(turn);
  return level >= static_cast<Loggers::value_type*>(handle)->second;
}

std::string getName(void* handle)
{
  return static_cast<Loggers::value_type*>(handle)->first;
}

bool get_loggers(std::map<std::string, Level>& found)
{
  std::lock_guard<std::mutex> hold(turn);
  found = loggers;
  return true;
}

bool set_logger_level(const std::string& name, Level level)
{
  std::lock_guard<std::mutex> hold(turn);
  loggers[name] = level;
  return true;
}

}}}
