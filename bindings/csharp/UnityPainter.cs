// A painter in Unity that uses osp. Each stroke is a mesh that grows while it is drawn, and the camera draws only the strokes that it may
// see. Use this sample as a starting point. It was compiled only with stand-ins for Unity's names (test/UnityNames.cs), never with Unity,
// and was never measured.
//
// Put Osp.cs and this file into a folder of Assets with an assembly definition that allows unsafe code, and the library
// (osp_c.dll, libosp_c.so, libosp_c.dylib) into Assets/Plugins. Add this component to the camera.
using System.Collections.Generic;
using OspCulling;
using UnityEngine;

[RequireComponent(typeof(Camera))]
public sealed class UnityPainter : MonoBehaviour
{
    readonly Dictionary<ulong, Renderer> strokes = new Dictionary<ulong, Renderer>();
    readonly float[] clipFromWorld = new float[16];
    HashSet<ulong> drawn = new HashSet<ulong>(), drawnBefore = new HashSet<ulong>();
    ulong[] visible = new ulong[1024];
    OspCuller culler;
    Camera eye;

    void Awake()
    {
        eye = GetComponent<Camera>();
        culler = new OspCuller();
    }

    void OnDestroy()
    {
        culler.Dispose();
    }

    /// <summary>Starts a stroke, whose renderer now has bounds.</summary>
    public void Begin(Renderer stroke)
    {
        strokes.Add(KeyOf(stroke), stroke);
        stroke.forceRenderingOff = true;
        Changed(stroke);
    }

    /// <summary>Updates a stroke that has grown or moved. Call this after the mesh has its new bounds, in the same frame.</summary>
    public void Changed(Renderer stroke)
    {
        culler.Set(KeyOf(stroke), BoxOf(stroke.bounds));
    }

    /// <summary>Removes an erased stroke.</summary>
    public void Erase(Renderer stroke)
    {
        culler.Remove(KeyOf(stroke));
        strokes.Remove(KeyOf(stroke));
    }

    // Unity calls this after all scripts have moved objects, and before the camera draws.
    void OnPreCull()
    {
        // Unity's projectionMatrix has OpenGL's depth on every platform. In memory a matrix is in column-major order. Each eye of a
        // headset has matrices of its own: eye.GetStereoProjectionMatrix and eye.GetStereoViewMatrix. Cull for both eyes in one call, and
        // draw the objects that at least one eye sees.
        Matrix4x4 matrix = eye.projectionMatrix * eye.worldToCameraMatrix;
        for (int i = 0; i < 16; i++)
        {
            clipFromWorld[i] = matrix[i];
        }
        culler.Cull(new OspCamera(clipFromWorld, OspDepth.MinusOneToOne));
        int count = culler.Visible(0, ref visible);
        // Only changed renderers are touched.
        drawn.Clear();
        for (int i = 0; i < count; i++)
        {
            drawn.Add(visible[i]);
            if (!drawnBefore.Remove(visible[i]))
            {
                strokes[visible[i]].forceRenderingOff = false;
            }
        }
        foreach (ulong key in drawnBefore)
        {
            Renderer stroke;
            if (strokes.TryGetValue(key, out stroke))
            {
                stroke.forceRenderingOff = true;
            }
        }
        HashSet<ulong> swap = drawnBefore;
        drawnBefore = drawn;
        drawn = swap;
    }

    static ulong KeyOf(Renderer stroke)
    {
        return unchecked((uint)stroke.GetInstanceID());
    }

    static OspBox BoxOf(Bounds bounds)
    {
        Vector3 min = bounds.min, max = bounds.max;
        return new OspBox(min.x, min.y, min.z, max.x, max.y, max.z);
    }
}
