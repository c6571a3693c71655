// The names of Unity that UnityPainter.cs calls, without any function. With them, a test compiles the sample against Osp.cs.
using System;

#pragma warning disable 649

namespace UnityEngine
{
    [AttributeUsage(AttributeTargets.Class)]
    public sealed class RequireComponent : Attribute
    {
        public RequireComponent(Type component)
        {
        }
    }

    public class MonoBehaviour
    {
        public T GetComponent<T>() where T : class
        {
            return null;
        }
    }

    public class Camera
    {
        public Matrix4x4 projectionMatrix, worldToCameraMatrix;
    }

    public struct Matrix4x4
    {
        public float this[int i]
        {
            get { return 0; }
        }

        public static Matrix4x4 operator *(Matrix4x4 a, Matrix4x4 b)
        {
            return a;
        }
    }

    public struct Vector3
    {
        public float x, y, z;
    }

    public struct Bounds
    {
        public Vector3 min, max;
    }

    public class Renderer
    {
        public Bounds bounds;
        public bool forceRenderingOff;

        public int GetInstanceID()
        {
            return 0;
        }
    }
}
